"""Handlers of gRPC's calls. Malformed bytes reach the door too, which answers them in the protocol's form."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import Protocol

import grpc

from roboglot.transport.host_calls import Handler, HostCalls
from roboglot.transport.last_messages import ending_with_last
from roboglot.wire.cyberdog.channel import SERVICE
from roboglot.wire.cyberdog.messages import reading
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb


class Calls(Protocol):
    """Handlers of the calls. A request is None if its bytes are malformed or its text is not UTF-8.

    ``sendMsg`` returns its last answer, if there is one more.
    """

    async def sendMsg(  # noqa: N802 - the service's name
        self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext, /
    ) -> pb.RecResponse | None: ...
    async def getFile(self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext, /) -> None: ...  # noqa: N802
    async def heartbeat(self, request: None, rpc: grpc.aio.ServicerContext, /) -> None: ...


def add_calls(
    server: grpc.aio.Server,
    calls: Calls,
    limit: HostCalls,
    holding: Callable[[], AbstractContextManager[None]] = nullcontext,
) -> None:
    """Have ``server`` serve ``calls`` within ``limit``; ``holding`` is held while a last answer is sent."""
    read = reading(pb.SendRequest.FromString)
    written, chunk, result = pb.RecResponse.SerializeToString, pb.FileChunk, pb.Result
    answering = ending_with_last(calls.sendMsg, written, holding)

    def method(handler: Handler, read: Callable[[bytes], object], write: Callable[..., bytes]) -> object:
        return grpc.unary_stream_rpc_method_handler(limit.limiting(handler), read, write)

    methods = {
        "sendMsg": method(answering, read, written),
        "getFile": method(calls.getFile, read, chunk.SerializeToString),
        "heartbeat": method(calls.heartbeat, lambda _: None, result.SerializeToString),  # as a stream: it has no answer
    }
    server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, methods),))
