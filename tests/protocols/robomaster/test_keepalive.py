"""Peers that vanished are disconnected or were never accepted; those that are there but do not read stay."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import struct
from dataclasses import dataclass, field
from typing import Any, cast
from unittest.mock import Mock

import pytest
import uvloop

from roboglot.protocols.robomaster.connection import ControlConnection
from roboglot.protocols.robomaster.keepalive import LOOK_PERIOD, probe_for_life, unanswered
from roboglot.protocols.robomaster.limits import WATCH_PERIOD
from tests.protocols.robomaster.text_client import ADDRESS

DEAD = 5000  # ms


@dataclass
class Line:
    """A connection from ``peer``, with what the kernel knows of it."""

    peer: str = "192.0.2.7"
    probes: int = 0
    segments: int = 0
    silent: int = 0
    aborted: bool = False
    looks: list[Any] = field(default_factory=list)

    def get_extra_info(self, name: str) -> Any:
        return self if name == "socket" else (self.peer, 4711)

    def setsockopt(self, _level: int, option: int, value: int) -> None:
        assert option != socket.TCP_KEEPCNT or value > 5.0 / WATCH_PERIOD, "the kernel would end it during the watch"
        assert option != socket.TCP_USER_TIMEOUT or value == 0, "it would end those who do not read"

    def getsockopt(self, *_: int) -> bytes:
        return struct.pack("=3xB20xI28xI", self.probes, self.segments, self.silent)

    def is_closing(self) -> bool:
        return self.aborted

    def abort(self) -> None:
        self.aborted = True


@pytest.fixture
async def looks(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """Calls planned for later."""
    planned: list[Any] = []
    monkeypatch.setattr(
        asyncio.get_running_loop(), "call_later", lambda after, call, *values: planned.append((after, call, values))
    )
    return planned


@pytest.mark.parametrize(
    ("line", "dead"),
    [
        (Line(silent=60_000), False),  # nothing was sent
        (Line(segments=3, silent=DEAD - 1), False),
        (Line(segments=3, silent=DEAD), True),
        (Line(probes=1, silent=60_000), False),  # it does not read; the last probe is on its way
        (Line(probes=4, silent=60_000), True),
        (Line(probes=60, silent=DEAD - 1), False),  # it drives, and is probed many times a second
    ],
)
async def test_only_dead_peers_are_disconnected(line: Line, dead: bool, looks: list[Any]) -> None:
    probe_for_life(cast(asyncio.Transport, line))
    [(after, look, values)] = looks
    assert after == LOOK_PERIOD
    looks.clear()
    look(*values)
    assert line.aborted is dead
    assert bool(looks) is not dead


@pytest.mark.parametrize("peer", ["127.0.0.9", "::1"])
async def test_kernel_knows_peers_of_this_machine(peer: str, looks: list[Any]) -> None:
    probe_for_life(cast(asyncio.Transport, Line(peer)))
    assert looks == []


def test_kernels_figures_stand_where_they_are_read() -> None:
    with socket.create_server((ADDRESS, 0)) as server, socket.create_connection(server.getsockname()) as client:
        served, _ = server.accept()
        with served:
            served.setblocking(False)
            with contextlib.suppress(BlockingIOError):
                while True:
                    served.send(bytes(65536))
            probes, _, silent = unanswered(served)
            assert (probes, silent < 60_000) == (0, True)
            client.recv(1)


def test_clients_gone_at_once_are_not_refused(caplog: pytest.LogCaptureFixture) -> None:
    uvloop.run(_meet_gone_clients(3))  # asyncio's own loop still knows whose they were
    assert "refused" not in caplog.text


async def _meet_gone_clients(count: int) -> None:
    made: list[ControlConnection] = []

    def make() -> ControlConnection:
        made.append(ControlConnection(Mock(), set(), Mock()))
        return made[-1]

    server = await asyncio.get_running_loop().create_server(make, ADDRESS, 0)
    for _ in range(count):
        with socket.create_connection(server.sockets[0].getsockname()) as gone:  # before it is accepted
            gone.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))  # ends with a reset
    async with asyncio.timeout(100):
        while len(made) < count or not all(hasattr(one, "transport") for one in made):  # noqa: ASYNC110
            await asyncio.sleep(0.005)
    server.close()
