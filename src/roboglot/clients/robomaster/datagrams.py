"""UDP at the client's end: the push port, which several robots share, and the broadcasts of free robots."""

from __future__ import annotations

import asyncio
import contextlib
import socket
from collections.abc import Callable, Collection

from roboglot.clients.errors import LinkLost
from roboglot.model.clock import Clock, RealClock
from roboglot.wire.robomaster.telemetry import broadcast_of

PUSH_PORT = 40924
BROADCAST_PORT = 40926
DATAGRAM_MAX = 8192
BATCH_MAX = 64  # datagrams read before other tasks run
ROBOTS_MAX = 256  # found by one search

Heard = Callable[[bytes], None]


class PushPort:
    """UDP port for the robots' pushes: one per machine, so the clients of one program share it. Open while
    one listens.

    ``host``: our address that the robots know; empty for all. Robots are distinguished by their source address.
    """

    def __init__(self, host: str = "", port: int = PUSH_PORT) -> None:
        self._host, self._port = host, port
        self._listeners: dict[str, list[Heard]] = {}
        self._socket: socket.socket | None = None

    def attach(self, robot: str, heard: Heard) -> Callable[[], None]:
        """Pass datagrams from the address ``robot`` to ``heard``; return a function to stop. Raises LinkLost."""
        if self._socket is None:
            self._socket = _bound(self._host, self._port, "share one PushPort between the clients of a program")
            asyncio.get_running_loop().add_reader(self._socket, self._read)
        self._listeners.setdefault(robot, []).append(heard)
        return lambda: self._detach(robot, heard)

    def _detach(self, robot: str, heard: Heard) -> None:
        with contextlib.suppress(KeyError, ValueError):
            self._listeners[robot].remove(heard)
            if not self._listeners[robot]:
                del self._listeners[robot]
        if not self._listeners and self._socket:
            asyncio.get_running_loop().remove_reader(self._socket)
            self._socket.close()
            self._socket = None

    def _read(self) -> None:
        for _ in range(BATCH_MAX):
            try:
                data, (robot, _) = self._socket.recvfrom(DATAGRAM_MAX) if self._socket else (b"", ("", 0))
            except OSError:  # no more data, or an ICMP error
                return
            for heard in tuple(self._listeners.get(robot, ())):
                heard(data)


async def discover(
    seconds: float = 5.0,
    *,
    first: bool = False,
    clock: Clock | None = None,
    port: int = BROADCAST_PORT,
    passing_over: Collection[str] = (),
) -> list[str]:
    """Return addresses of free robots on the network, which broadcast every 2 s (manual 3.2.19).

    Listens for ``seconds``, or with ``first`` until one is found. Addresses in ``passing_over`` are ignored. Raises
    LinkLost if the port is taken.
    """
    loop, clock = asyncio.get_running_loop(), clock or RealClock()
    found: dict[str, None] = {}
    enough = loop.create_future()
    with contextlib.closing(_bound("", port, "something else on this machine looks for robots")) as listener:

        def read() -> None:
            with contextlib.suppress(OSError):
                data, (sender, _) = listener.recvfrom(DATAGRAM_MAX)
                if sender in passing_over:
                    return
                if broadcast_of(data) == sender and len(found) < ROBOTS_MAX:  # addressed to another robot
                    found[sender] = None
                    if first and not enough.done():
                        enough.set_result(None)

        loop.add_reader(listener, read)
        try:
            await clock.wait_for(enough, seconds)
        except TimeoutError:
            pass
        finally:
            loop.remove_reader(listener)
    return list(found)


def _bound(host: str, port: int, hint: str) -> socket.socket:
    bound = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    try:
        bound.setblocking(False)
        if port == BROADCAST_PORT:
            bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)  # every listener receives broadcasts
        bound.bind((host, port))
    except OSError as error:
        bound.close()
        raise LinkLost(f"UDP {host or '*'}:{port}: {error.strerror or error}; {hint}") from None
    return bound
