"""Channels of a door's WebSocket: each path opens a session for its client. Knows no socket."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Awaitable, Callable, Coroutine
from dataclasses import replace
from typing import Protocol

from roboglot.model.inputs.external import CAME, GONE, ExternalInputs
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.turns import Turns
from roboglot.values import dataclass

Send = Callable[[str], None]
Drain = Callable[[], Awaitable[None]]


class Carrier(Protocol):
    """The connection of one client, as its session uses it."""

    @property
    def name(self) -> str:
        """Address and port of the other end."""

    @property
    def who(self) -> str:
        """Name of the client, as in control leases."""

    @property
    def subprotocol(self) -> str:
        """Negotiated subprotocol; empty: none."""

    @property
    def unsent(self) -> int:
        """Number of bytes that the client has yet to read."""

    def send(self, message: str | bytes) -> None:
        """Send one message, a text or bytes; disconnect a client that does not read."""

    async def drain(self) -> None:
        """Wait until the client has caught up."""


class Session(Protocol):
    """One client at one path, from its opening to its end."""

    def receive(self, message: str | bytes) -> Coroutine[object, None, None]:
        """Handle one message; calls begin in the order of the messages, and run concurrently where they wait."""

    def close(self) -> None:
        """Handle the client's departure."""


@dataclass(frozen=True, slots=True)
class Channel:
    """Endpoint behind a path of the WebSocket; ``right`` is needed to open it.

    ``open`` makes the session of a client, which may send at once. Raises RuntimeError where there are too many.
    ``subprotocols``: one of them must be offered, the first in this order is taken; empty: none is needed.
    """

    open: Callable[[Carrier], Session]
    right: Right = Right.SEE
    subprotocols: tuple[str, ...] = ()
    binary: bool = False


class TextSession:
    """Session made of two functions: ``receive`` handles a text, ``subscribe`` returns a function that unsubscribes.

    ``subscribe`` gets a function to send a text, and one to await a slow client.
    """

    def __init__(
        self,
        connection: Carrier,
        subscribe: Callable[[Send, Drain], Callable[[], None]],
        receive: Callable[[str, Send], Awaitable[None]],
    ) -> None:
        self._send, self._receive = connection.send, receive
        self.close = subscribe(connection.send, connection.drain)

    async def receive(self, message: str | bytes) -> None:
        """Pass the message on."""
        await self._receive(str(message), self._send)


def text_channel(
    subscribe: Callable[[Send, Drain], Callable[[], None]],
    receive: Callable[[str, Send], Awaitable[None]],
    right: Right = Right.SEE,
) -> Channel:
    """Return a channel for texts; see ``TextSession``."""
    return Channel(lambda connection: TextSession(connection, subscribe, receive), right)


class _NotedSession:
    """Session whose end is noted as an input."""

    def __init__(self, inner: Session, note: Callable[[], None]) -> None:
        self._inner, self._note = inner, note
        self.receive = inner.receive

    def close(self) -> None:
        """Note the end before its consequences."""
        self._note()
        self._inner.close()


def noted(channel: Channel, inputs: ExternalInputs, door: str, path: str) -> Channel:
    """Return the channel with its clients' arrivals and departures noted as the robot's inputs."""

    def open_noted(carrier: Carrier) -> Session:
        session = channel.open(carrier)
        inputs.note_client(CAME, door, carrier.name, path=path)
        return _NotedSession(session, lambda: inputs.note_client(GONE, door, carrier.name))

    return replace(channel, open=open_noted)


class _FairSession:
    """Session whose messages wait for their turns."""

    def __init__(self, inner: Session, turns: Turns, stops: Callable[[str | bytes], bool]) -> None:
        self._inner, self._turns, self._stops = inner, turns, stops
        self._order = asyncio.Lock()
        self._waiting: deque[str | bytes] = deque()
        self.close = inner.close

    async def receive(self, message: str | bytes) -> None:
        """Pass the message on when it is its turn, and no earlier one waits."""
        self._waiting.append(message)
        self._turns.look()
        async with self._order:
            try:
                await self._turns.take(lambda: any(map(self._stops, self._waiting)))
            finally:
                self._waiting.popleft()
        await self._turns.count(self._inner.receive(message))


def taking_turns(channel: Channel, robot: Robot, stops: Callable[[str | bytes], bool]) -> Channel:
    """Return the channel with fairness between clients; ``stops`` returns whether a message stops the robot."""

    def open_fair(carrier: Carrier) -> Session:
        return _FairSession(channel.open(carrier), Turns(robot, carrier.name), stops)

    return replace(channel, open=open_fair)
