"""The control connection: one command, one answer, in order; reports a lost link. Knows no commands."""

from __future__ import annotations

import asyncio
import itertools
import socket
from collections.abc import Callable
from typing import cast

from roboglot.clients.errors import BadAnswer, ClientError, LinkLost, TimedOut
from roboglot.clients.robomaster.noting import Noting
from roboglot.clients.robomaster.pairing import Pairing
from roboglot.model.clock import Clock

PENDING_MAX = 256  # unanswered commands; beyond this the robot counts as unresponsive
CONNECT_SECONDS_MAX = 5.0
KEEPALIVE = (1, 1, 3)  # s of silence before the first probe, s between probes, lost probes that end it


class ControlLink(asyncio.Protocol):
    """One TCP connection to the control port; never reopened, its owner makes a new one. ``lost`` is called once."""

    def __init__(self, clock: Clock, lost: Callable[[str], None], noting: Noting | None = None) -> None:
        self._clock, self._lost, self._noting = clock, lost, noting
        self._numbers = itertools.count(1)
        self._pairing = Pairing()
        self._answers: dict[int, asyncio.Future[str]] = {}
        self._transport: asyncio.Transport | None = None
        self.closed = asyncio.Event()

    @property
    def open(self) -> bool:
        """True while commands can be sent."""
        return self._transport is not None and not self._transport.is_closing()

    @property
    def as_robots(self) -> bool:
        """True if the answers so far match a real robot's build."""
        return self._pairing.as_robots

    @property
    def peer_host(self) -> str:
        """The robot's address, from which its pushes come."""
        assert self._transport
        name: tuple[str, int] = self._transport.get_extra_info("peername")
        return name[0]

    @property
    def descriptor(self) -> int:
        """File descriptor of the socket."""
        assert self._transport
        number: int = self._transport.get_extra_info("socket").fileno()
        return number

    async def ask(self, command: str, timeout: float, *, numbered: bool = True) -> str:
        """Send one command (no ``;``, no ``seq``) and return its answer. Raises LinkLost, TimedOut.

        After TimedOut the robot may or may not have obeyed; a late answer is ignored. Not ``numbered``: the answer
        is found by its place alone, and its end shows the robot's build.
        """
        if not self.open or self._transport is None:
            raise LinkLost(f"no connection: {command!r} was not sent")
        if len(self._pairing) >= PENDING_MAX:
            raise LinkLost(f"{PENDING_MAX} commands wait for an answer: {command!r} was not sent")
        number = next(self._numbers)
        answer: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        self._answers[number] = answer
        self._pairing.sent(number, bare=not numbered)
        text = f"{command} seq {number};" if numbered else f"{command};"
        self._transport.write(text.encode())
        if self._noting is not None:
            self._noting.sent(number, text)
        why = "the caller stopped waiting"
        try:
            return await self._clock.wait_for(answer, timeout)
        except TimeoutError:
            why = f"no answer to {command!r} within {timeout:g} s"
            raise TimedOut(why) from None
        except ClientError as error:
            why = str(error)
            raise
        finally:
            self._answers.pop(number, None)
            if self._noting is not None:
                self._noting.lost(number, why)

    def close(self) -> None:
        """Disconnect; commands that await an answer raise LinkLost."""
        if self._transport:
            self._transport.abort() if self._transport.get_write_buffer_size() else self._transport.close()

    # -- callbacks of asyncio --

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self._transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it
        keep_asking(transport.get_extra_info("socket"))

    def data_received(self, data: bytes) -> None:
        wordings: dict[int, str] = {}
        self._pairing.wordings = wordings if self._noting is not None and self._noting.line.watched else None
        try:
            for number, text in self._pairing.received(data):
                if self._noting is not None:
                    self._noting.answered(number, wordings.get(number, text), text)
                if (answer := self._answers.get(number)) and not answer.done():
                    answer.set_result(text)
        except ValueError as error:
            self._fail(BadAnswer(str(error)))
            self.close()

    def connection_lost(self, exc: Exception | None) -> None:
        why = f"the connection broke: {exc}" if exc else "the connection ended"
        self._fail(LinkLost(why))
        self.closed.set()
        self._lost(why)

    def _fail(self, error: Exception) -> None:
        for answer in self._answers.values():
            if not answer.done():
                answer.set_exception(error)


def keep_asking(connection: socket.socket) -> None:
    """Let the kernel detect a vanished peer within about four seconds."""
    idle, interval, count = KEEPALIVE
    connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in (("TCP_KEEPIDLE", idle), ("TCP_KEEPINTVL", interval), ("TCP_KEEPCNT", count)):
        if hasattr(socket, name):  # not available on every system
            connection.setsockopt(socket.IPPROTO_TCP, getattr(socket, name), value)
    if hasattr(socket, "TCP_USER_TIMEOUT"):
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_USER_TIMEOUT, (idle + interval * count) * 1000)


async def connect(
    clock: Clock,
    host: str,
    port: int,
    local: str | None,
    lost: Callable[[str], None],
    noting: Noting | None = None,
) -> ControlLink:
    """Open a link. Raises LinkLost or TimedOut."""
    opening = asyncio.get_running_loop().create_connection(
        lambda: ControlLink(clock, lost, noting),
        host,
        port,
        local_addr=(local, 0) if local else None,
        family=socket.AF_INET,
    )
    try:
        _, link = await clock.wait_for(opening, CONNECT_SECONDS_MAX)
    except TimeoutError:
        raise TimedOut(f"{host}:{port} does not answer") from None
    except OSError as error:
        raise LinkLost(f"{host}:{port} cannot be reached: {error.strerror or error}") from None
    return link
