"""Clients that vanish: the kernel asks silent ones, of every port, for a sign of life."""

from __future__ import annotations

import asyncio
import socket

import pytest

from roboglot.console.server import bound
from roboglot.transport.listening import SILENT_PROBES, end_vanished, listen


async def test_silent_client_of_any_port_is_probed() -> None:
    accepted: asyncio.Future[asyncio.BaseTransport] = asyncio.get_running_loop().create_future()

    class Door(asyncio.Protocol):
        def connection_made(self, transport: asyncio.BaseTransport) -> None:
            accepted.set_result(transport)

    server = await listen(Door, "127.0.0.1", 0)
    _, writer = await asyncio.open_connection("127.0.0.1", server.sockets[0].getsockname()[1])
    try:
        connection = (await accepted).get_extra_info("socket")
        assert connection.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
        assert connection.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 40_000
        options = (socket.TCP_KEEPIDLE, socket.TCP_KEEPINTVL, socket.TCP_KEEPCNT)
        assert tuple(connection.getsockopt(socket.IPPROTO_TCP, option) for option in options) == SILENT_PROBES
    finally:
        writer.close()
        (await accepted).close()  # type: ignore[attr-defined] # a base transport has it
        server.close()


def test_client_of_a_starting_console_is_probed() -> None:
    with bound("127.0.0.1", 0) as listening, socket.create_connection(listening.getsockname()):
        accepted, _ = listening.accept()
        with accepted:
            assert accepted.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
            assert accepted.getsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT) == 40_000


def test_ports_open_where_the_kernel_lacks_these_options(monkeypatch: pytest.MonkeyPatch) -> None:
    """``roboglot connect`` runs on people's own machines: macOS and Windows have no TCP_USER_TIMEOUT."""
    monkeypatch.setattr("sys.platform", "darwin")
    for option in ("TCP_KEEPIDLE", "TCP_USER_TIMEOUT"):
        monkeypatch.delattr(socket, option)
    with socket.create_server(("127.0.0.1", 0)) as listening:
        end_vanished(listening)
