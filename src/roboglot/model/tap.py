"""Live exchanges of a robot's doors and driver: for the console, recordings, the audit and counters.

A door calls ``request`` once it has parsed a request, ``reply`` when it answers, and ``push`` for unsolicited messages,
each behind ``if tap.watched``, which is the whole cost without subscribers. The client is the one that the door named
with ``set_client``. The driver of a real robot notes its messages to and from the robot through a ``Line``, as the door
``driver/NAME``.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from enum import StrEnum
from typing import NamedTuple

from roboglot.model.client_context import client, connection
from roboglot.model.clock import Clock
from roboglot.model.events.listeners import Failures, call_all
from roboglot.model.feed import Feed, Viewer

QUEUE_MAX = 4096  # exchanges queued per viewer; beyond this they are dropped and counted
_SECRET = re.compile(rb"""("\w*[Pp]assword"\s*:\s*)(?:"(?:[^"\\]|\\.)*(?:"|\Z)|[^\s",{\[][^,}\]]*)""", re.DOTALL)
# The same for JSON inside a JSON string.
_SECRET_IN_TEXT = re.compile(rb"""(\\"\w*[Pp]assword\\"\s*:\s*\\")(?:[^"\\]|\\\\.)*""", re.DOTALL)
LOST = "lost"  # status if a real robot does not answer
DRIVER = "driver/"  # prefix of a driver's name in place of a door's
SILENT = "silent"  # status of a request that gets no answer
PAYLOAD_MAX = 8 * 1024 * 1024  # bytes kept of one exchange


def without_secrets(data: bytes) -> bytes:
    """Return JSON, or what contains some, with the values of passwords replaced."""
    return _SECRET_IN_TEXT.sub(rb"\1***", _SECRET.sub(rb'\1"***"', data))


class Direction(StrEnum):
    """Direction of an exchange."""

    REQUEST = "request"
    REPLY = "reply"
    PUSH = "push"


class Exchange(NamedTuple):  # created for each message: a frozen dataclass takes five times as long
    """One message of one door, or of the driver of a real robot, in either direction.

    ``stamp``: robot time in s. ``connection``: the other end's address ("127.0.0.1:40312"), or a name where there is
    none. ``client``: its name, as in control leases. ``operation``: the key in the protocol's contract, or empty.
    ``payload``: the message in the protocol's own bytes (REST: "POST /path?query", an empty line, the body), with
    passwords left out. Of a reply: ``status`` in the protocol's words ("200", "ok", "fail"), ``refusal`` why it was not
    done in plain words (empty: it was), ``seconds`` of robot time since the request. Of a request: ``turn`` of the
    clock.
    """

    stamp: float
    robot: str
    door: str
    connection: str
    client: str
    direction: Direction
    operation: str
    payload: bytes
    status: str = ""
    refusal: str = ""
    seconds: float = 0.0
    turn: int = -1


class _Answer(NamedTuple):
    """Outcome of a request, and the request's time, if known."""

    status: str = ""
    refusal: str = ""
    began: float | None = None


NO_ANSWER = _Answer()


class Tap:
    """One robot's exchanges. ``watched`` is True while there is a viewer; doors check it first."""

    def __init__(self, robot: str, clock: Clock) -> None:
        self.watched = False
        self._robot = robot
        self._clock = clock
        self._listeners: list[Callable[[Exchange], None]] = []
        self._failures = Failures()
        self._feed: Feed[Exchange] = Feed(self._look, self._look, queue_max=QUEUE_MAX)

    def subscribe(self) -> Viewer[Exchange]:
        """Return a bounded queue of further exchanges, for slow readers. Raises Busy for too many subscribers."""
        return self._feed.subscribe()

    def listen(self, listener: Callable[[Exchange], None]) -> Callable[[], None]:
        """Call ``listener``, which must be quick, on every exchange; return a function that unsubscribes it."""
        self._listeners.append(listener)
        self._look()

        def leave() -> None:
            if listener in self._listeners:
                self._listeners.remove(listener)
            self._look()

        return leave

    def line(self, driver: str, address: str) -> Line:
        """Return the line on which a driver notes its messages to and from the robot at ``address``."""
        return Line(self, f"{DRIVER}{driver}", address)

    def request(self, door: str, operation: str, payload: bytes | str) -> float:
        """Note a client's request; return its time, for ``reply``."""
        return self._pass(Direction.REQUEST, door, connection(), operation, payload)

    def reply(
        self,
        door: str,
        operation: str,
        payload: bytes | str,
        status: str,
        refusal: str = "",
        began: float | None = None,
    ) -> None:
        """Note the door's answer to the request made at ``began`` (None: unknown)."""
        self._pass(Direction.REPLY, door, connection(), operation, payload, _Answer(status, refusal, began))

    def push(self, door: str, to: str, operation: str, payload: bytes | str) -> None:
        """Note an unsolicited message to the address ``to``."""
        self._pass(Direction.PUSH, door, to, operation, payload)

    def _pass(
        self,
        direction: Direction,
        door: str,
        other_end: str,
        operation: str,
        payload: bytes | str,
        answer: _Answer = NO_ANSWER,
    ) -> float:
        now = self._clock.time()
        data = payload.encode("utf-8", "replace") if isinstance(payload, str) else bytes(payload)
        seconds = 0.0 if answer.began is None else now - answer.began
        if b"assword" in data:
            data = without_secrets(data)
        exchange = Exchange(
            now,
            self._robot,
            door,
            other_end,
            client(),
            direction,
            operation,
            data[:PAYLOAD_MAX],
            answer.status,
            answer.refusal,
            seconds,
            self._clock.turn if direction is Direction.REQUEST else -1,
        )
        call_all(self._listeners, exchange, self._failures)
        if self._feed.viewers:
            self._feed.push(exchange)
        return now

    def _look(self) -> None:
        """Update ``watched`` after a subscriber came or left."""
        self.watched = bool(self._listeners or self._feed.viewers)


class Line:
    """Notes a driver's exchanges with its robot; check ``watched`` first, as with a tap."""

    def __init__(self, tap: Tap, door: str, address: str) -> None:
        self._tap, self._door, self.address = tap, door, address

    @property
    def watched(self) -> bool:
        """True if the tap has subscribers."""
        return self._tap.watched

    def request(self, operation: str, payload: bytes | str) -> float:
        """Note a request to the robot; return its time, for ``reply``."""
        return self._tap._pass(Direction.REQUEST, self._door, self.address, operation, payload)

    def reply(
        self, operation: str, payload: bytes | str, status: str, refusal: str = "", began: float | None = None
    ) -> None:
        """Note the robot's answer to the request made at ``began``; status LOST: none came."""
        self._tap._pass(Direction.REPLY, self._door, self.address, operation, payload, _Answer(status, refusal, began))

    def push(self, operation: str, payload: bytes | str) -> None:
        """Note an unsolicited message of the robot."""
        self._tap._pass(Direction.PUSH, self._door, self.address, operation, payload)
