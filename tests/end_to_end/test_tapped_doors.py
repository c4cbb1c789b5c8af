"""All four doors of one robot pass what they hear and say to the tap, with the keys of their contracts."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import grpc
import httpx
import pytest

from roboglot.clients.visual import TextLink
from roboglot.config import RobotConfig, load_config
from roboglot.model.clock import LockstepClock
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto.cyberdog_app_pb2_grpc import GrpcAppStub

ADDRESS = free_addresses(1)


@pytest.fixture
async def runtime(tmp_path: Path) -> AsyncIterator[Runtime]:
    base = load_config(None, {"data": str(tmp_path / "data"), "world": "empty", "lockstep": True})
    config = replace(
        base, robots=(RobotConfig("a", "universal", ADDRESS),), doors={"cyberdog": CyberDogConfig(plaintext=True)}
    )
    runtime = Runtime(config)
    await runtime.start()
    yield runtime
    await runtime.close()


def words(exchange: Exchange) -> tuple[str, str, str]:
    return exchange.direction, exchange.operation, exchange.status


async def rest(asked: list[Exchange]) -> None:
    async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", verify=False) as client:
        await client.get("/api/core/slam/v1/localization/pose")
        await client.post("/api/core/motion/v1/actions?x=1", json={"action_name": "none"})
        await client.get("/nowhere")
    pose, actions = "GET /api/core/slam/v1/localization/pose", "POST /api/core/motion/v1/actions"
    assert [words(exchange) for exchange in asked] == [
        (Direction.REQUEST, pose, ""),
        (Direction.REPLY, pose, "200"),
        (Direction.REQUEST, actions, ""),
        (Direction.REPLY, actions, "400"),
        (Direction.REQUEST, "", ""),
        (Direction.REPLY, "", "404"),
    ]
    assert asked[2].payload == b'POST /api/core/motion/v1/actions?x=1\n\n{"action_name":"none"}'
    assert asked[3].refusal.startswith("Can not create action")
    assert json.loads(asked[1].payload)["x"] == pytest.approx(0.0, abs=0.1)


async def text(asked: list[Exchange]) -> None:
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    for command, answered in (
        (b"chassis speed x 1;", b"not in sdk mode;"),
        (b"command;", b"ok;"),
        (b"led cook;", b";"),
    ):
        writer.write(command)
        await reader.readuntil(answered)
    writer.close()
    assert [words(exchange) for exchange in asked] == [
        (Direction.REQUEST, "", ""),
        (Direction.REPLY, "", "not in sdk mode"),
        (Direction.REQUEST, "command", ""),
        (Direction.REPLY, "command", "ok"),
        (Direction.REQUEST, "", ""),
        (Direction.REPLY, "", "command format error: command parse error"),
    ]
    assert asked[3].payload == b"ok;"
    assert "no such command" in asked[5].refusal


async def dog(asked: list[Exchange]) -> None:
    async with grpc.aio.insecure_channel(f"{ADDRESS}:50052") as channel:
        stub = GrpcAppStub(channel)
        for code, params in ((10001, "{}"), (1001, "{"), (4242, "{}")):
            async for _ in stub.sendMsg(pb.SendRequest(nameCode=code, params=params)):
                pass
    assert [words(exchange) for exchange in asked if exchange.direction is not Direction.PUSH][2:4] == [
        (Direction.REQUEST, "1001", ""),
        (Direction.REPLY, "1001", "error_code 323"),
    ]
    assert (asked[-1].status, asked[-1].payload) == ("silent", b"")
    assert asked[-1].refusal == "this operation is not implemented"


async def programs(asked: list[Exchange]) -> None:
    link = await TextLink.open(f"ws://{ADDRESS}:50053", "/programs")
    for frame in ('{"type": "task", "id": "1", "operate": "inquiry", "target_id": []}', "no"):
        await link.send(frame)
        await anext(link)
    await link.close()
    assert [words(exchange) for exchange in asked] == [
        (Direction.REQUEST, "task inquiry", ""),
        (Direction.REPLY, "task inquiry", "ok"),
        (Direction.REQUEST, "", ""),
        (Direction.REPLY, "", "state 1"),
    ]


async def test_every_door_passes_on_what_it_transfers(runtime: Runtime) -> None:
    tap = runtime.fleet.robots["a"].tap
    for name, use in (("slamware", rest), ("robomaster", text), ("cyberdog", dog), ("visual", programs)):
        heard: list[Exchange] = []
        leave = tap.listen(heard.append)
        await use(heard)
        leave()
        assert {exchange.door for exchange in heard} == {name}
        assert all(exchange.client.startswith(f"{name} 127.0.0.1") for exchange in heard if exchange.client)
    assert not tap.watched


async def test_pushes_are_passed_on_with_their_key(runtime: Runtime) -> None:
    clock, tap = runtime.clock, runtime.fleet.robots["a"].tap
    assert isinstance(clock, LockstepClock)
    reader, writer = await asyncio.open_connection(ADDRESS, 40923)
    with tap.subscribe() as viewer:
        writer.write(b"command;chassis push freq 5 position on;")
        await reader.readuntil(b"ok;ok;")
        await clock.advance(1.0)
        pushes = [exchange for exchange in viewer.drain() if exchange.direction is Direction.PUSH]
    writer.close()
    assert {(push.connection, push.operation) for push in pushes} == {("127.0.0.1:40924", "> chassis push")}
    assert len(pushes) == 5
