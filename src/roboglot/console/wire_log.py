"""Log of a robot's exchanges over the last ten minutes. Runs only while pages show it, and ten minutes longer."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Iterable
from typing import Any

from roboglot.console.settings import EXCERPT_MAX, PAYLOAD_MAX, WIRE_BYTES_MAX, WIRE_MAX, WIRE_SECONDS
from roboglot.model.errors import NotFound
from roboglot.model.robot import Robot
from roboglot.model.tap import Exchange
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Entry:
    """An exchange and its serial number."""

    number: int
    exchange: Exchange


class WireLog:
    """Log of one robot."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._entries: deque[Entry] = deque(maxlen=WIRE_MAX)
        self._bytes = 0
        self._last = 0
        self._viewers = 0
        self._leave: Callable[[], None] | None = None
        self._ending: asyncio.TimerHandle | None = None

    @property
    def last(self) -> int:
        """The number of the newest exchange; 0 before the first."""
        return self._last

    def open(self) -> None:
        """Add a viewer; start listening with the first."""
        self._viewers += 1
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None
        if self._leave is None:
            self._leave = self._robot.tap.listen(self._note)

    def close(self) -> None:
        """Remove a viewer; after the last one, the log goes on for ten minutes in case one returns."""
        self._viewers -= 1
        if not self._viewers:
            self._ending = asyncio.get_running_loop().call_later(WIRE_SECONDS, self.end)

    def end(self) -> None:
        """Stop listening and clear the log."""
        if self._ending is not None:
            self._ending.cancel()
            self._ending = None
        if self._leave is not None:
            self._leave()
            self._leave = None
        self._entries.clear()
        self._bytes = 0

    def after(self, number: int, most: int) -> list[Entry]:
        """Return the newest ``most`` entries after ``number``, oldest first."""
        found: list[Entry] = []
        for entry in reversed(self._entries):
            if entry.number <= number or len(found) >= most:
                break
            found.append(entry)
        return found[::-1]

    def get(self, number: int) -> Exchange:
        """Return an exchange by number. Raises NotFound."""
        if self._entries and (index := number - self._entries[0].number) >= 0 and index < len(self._entries):
            return self._entries[index].exchange
        raise NotFound(f"exchange {number} is no longer stored")

    def _note(self, exchange: Exchange) -> None:
        if len(exchange.payload) > PAYLOAD_MAX:
            exchange = exchange._replace(payload=exchange.payload[:PAYLOAD_MAX])
        self._last += 1
        if len(self._entries) == WIRE_MAX:
            self._drop()
        self._entries.append(Entry(self._last, exchange))
        self._bytes += len(exchange.payload)
        while self._bytes > WIRE_BYTES_MAX or self._entries[0].exchange.stamp < exchange.stamp - WIRE_SECONDS:
            self._drop()

    def _drop(self) -> None:
        self._bytes -= len(self._entries.popleft().exchange.payload)


def rows(entries: Iterable[Entry]) -> list[list[Any]]:
    """Return [number, stamp s, door, connection, client, direction, operation, status, refusal, ms, bytes, excerpt]."""
    return [
        [
            entry.number,
            round(exchange.stamp, 3),
            exchange.door,
            exchange.connection,
            exchange.client,
            exchange.direction,
            exchange.operation,
            exchange.status,
            exchange.refusal,
            round(exchange.seconds * 1000.0, 1),
            len(exchange.payload),
            readable(exchange.payload)[:EXCERPT_MAX],
        ]
        for entry in entries
        for exchange in (entry.exchange,)
    ]


def readable(payload: bytes) -> str:
    """Return text as it is, other bytes in hexadecimal."""
    try:
        text = payload.decode("utf-8")
    except UnicodeDecodeError:
        return payload[:EXCERPT_MAX].hex(" ")
    printable = all(character.isprintable() or character in "\r\n\t" for character in text[:EXCERPT_MAX])
    return text if printable else payload[:EXCERPT_MAX].hex(" ")
