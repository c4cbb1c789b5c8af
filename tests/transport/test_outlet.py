"""Answers to a client that is gone are dropped: uvloop raises at the second write, and each left a traceback."""

from __future__ import annotations

import asyncio
from typing import Any, cast

import pytest
from uvicorn.config import Config
from uvicorn.server import ServerState

from roboglot.protocols.slamware.http_connection import ReasonTransport
from roboglot.transport.http import BoundedConnection
from roboglot.transport.outlet import Outlet

ANSWER = (b"HTTP/1.1 200 OK\r\n\r\n", b"x", bytes(1 << 20), b"HTTP/1.1 200 OK\r\n\r\n")


class Gone(asyncio.Transport):
    """As uvloop's after a failed write."""

    def is_closing(self) -> bool:
        return True

    def write(self, data: bytes | bytearray | memoryview[Any]) -> None:
        raise RuntimeError(f"{len(data)} bytes: the handler is closed")

    def close(self) -> None:
        pass

    def get_extra_info(self, name: str, default: Any = None) -> Any:
        return {"peername": ("127.0.0.1", 1)}.get(name, default)


@pytest.mark.parametrize("kind", [Outlet, ReasonTransport])
async def test_writes_to_a_lost_client_are_dropped(kind: type[Outlet]) -> None:
    transport = kind(Gone())
    for data in ANSWER:
        transport.write(data)
    transport.close()


async def test_console_drops_writes_to_a_lost_client() -> None:
    config = Config(cast(Any, None), ws="none", lifespan="off", log_config=None, interface="asgi3")
    config.load()
    connection = BoundedConnection(config, ServerState(), {}, asyncio.get_running_loop())
    connection.connection_made(Gone())
    for data in ANSWER:
        connection.transport.write(data)
    connection.connection_lost(None)
