"""Apps that answer without end, or with bytes of any kind: the robot reads little of it, and the log stays short."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator

import grpc
import pytest

from roboglot.protocols.cyberdog.app_line import DONE, AppLine
from roboglot.wire.cyberdog.channel import SERVICE
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

PATIENCE = 60.0  # real s


class Hostile:
    """An app that answers pushes for ever."""

    def __init__(self, answer: bytes) -> None:
        self.ended = asyncio.Event()
        self._answer = answer
        self._server = grpc.aio.server()
        calls = {
            "heartbeat": grpc.unary_unary_rpc_method_handler(self._beat),
            "sendMsg": grpc.unary_stream_rpc_method_handler(self._push),
        }
        self._server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, calls),))
        self.port = self._server.add_insecure_port("127.0.0.1:0")

    async def _beat(self, _request: bytes, _context: object) -> bytes:
        return self._answer

    async def _push(self, _request: bytes, _context: object) -> AsyncIterator[bytes]:
        try:
            while True:
                yield self._answer
        finally:
            self.ended.set()

    async def __aenter__(self) -> Hostile:
        await self._server.start()
        return self

    async def __aexit__(self, *_: object) -> None:
        await self._server.stop(None)


@pytest.mark.parametrize("answer", [b"", b"\xff\xff", b"\x12\x02\xff\xfe", bytes(100_000)])
async def test_few_answers_to_a_push_are_read(answer: bytes, caplog: pytest.LogCaptureFixture) -> None:
    async with Hostile(answer) as app, asyncio.timeout(PATIENCE):
        line = AppLine(f"127.0.0.1:{app.port}", None)
        assert await line.heartbeat(pb.Ticks()) == DONE
        assert await line.push(2001, "{}") == DONE
        await app.ended.wait()
        await line.close()
    warnings = [record.getMessage() for record in caplog.records if record.levelno >= logging.WARNING]
    assert not [text for text in warnings if "servicer method" not in text]  # the app's gRPC notes its cut-off answers
