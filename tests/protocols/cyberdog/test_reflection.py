"""Server reflection: off unless switched on; then a client that knows nothing finds the service and its messages."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import grpc
import pytest
from google.protobuf import descriptor_pb2

from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.reflection import VERSIONS, _kinds
from roboglot.protocols.cyberdog.server import CyberDogDoor
from tests.protocols.cyberdog.phone import ADDRESS, Pems

pytestmark = pytest.mark.world("empty")


async def ask(channel: grpc.aio.Channel, package: str, *questions: dict[str, str]) -> list[Any]:
    kinds = _kinds(package)
    request, response = kinds["ServerReflectionRequest"], kinds["ServerReflectionResponse"]
    call = channel.stream_stream(
        f"/{package}.ServerReflection/ServerReflectionInfo", request.SerializeToString, response.FromString
    )
    return [answer async for answer in call(iter([request(**question) for question in questions]))]


@pytest.mark.parametrize("package", VERSIONS)
async def test_tools_find_the_service(robot, data: Path, pems: Pems, package: str) -> None:
    door = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, reflection=True), data)
    await door.start()
    try:
        async with pems.channel(door.port) as channel:
            services, symbol, method, nothing = await ask(
                channel,
                package,
                {"list_services": "*"},
                {"file_containing_symbol": "grpcapi.GrpcApp"},
                {"file_containing_symbol": "grpcapi.GrpcApp.sendMsg"},
                {"file_containing_symbol": "grpcapi.Nonsense"},
            )
    finally:
        await door.close()
    assert "grpcapi.GrpcApp" in {service.name for service in services.list_services_response.service}
    (raw,) = symbol.file_descriptor_response.file_descriptor_proto
    file = descriptor_pb2.FileDescriptorProto.FromString(raw)
    assert {method.name for method in file.service[0].method} == {"sendMsg", "heartbeat", "getFile"}
    assert method.file_descriptor_response.file_descriptor_proto == [raw]
    assert nothing.error_response.error_code == 5


async def test_it_is_off_by_default(door, pems: Pems) -> None:
    async with pems.channel(door.port) as channel:
        with pytest.raises(grpc.aio.AioRpcError) as refused:
            await ask(channel, VERSIONS[0])  # no question: a refusal may come before one is sent
    assert refused.value.code() is grpc.StatusCode.UNIMPLEMENTED
