"""A classroom in another process of this machine, shared by the consoles of several worlds: lines over a socket.

Contains the messages of both ends, and the console's end, whose seats behave as if the classroom were local.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated

import msgspec

from roboglot.console.studio.class_requests import Member
from roboglot.console.studio.classroom import CODE_LENGTH, CODE_LETTERS, Place, Tell
from roboglot.model.errors import NotFound, Refused, RobotError

log = logging.getLogger(__name__)
LINE_MAX = 4 << 20  # bytes
UNREAD_MAX = 32 << 20  # bytes unread by the other end, which then counts as hung and is disconnected
ADMIT_SECONDS = 10.0
ADMITTING_MAX = 64  # requests to join that await an answer
AGAIN = 1.0  # s between two attempts to connect
Code = Annotated[str, msgspec.Meta(pattern=rf"^[{CODE_LETTERS}]{{{CODE_LENGTH}}}\Z")]  # a folder has this name
Name = Annotated[str, msgspec.Meta(max_length=1000)]


class Hello(msgspec.Struct, tag=True, frozen=True):
    """First message to the classroom: the console's world, and the URL of its pages."""

    world: Name
    page: Name


class PageRequest(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: a page's request."""

    seat: int
    request: Member
    may_teach: bool


class At(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: the robot that a page works with."""

    seat: int
    robot: str


class Drawn(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: the map of that robot, a PNG in base64."""

    seat: int
    png: str


class Left(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: a page has gone."""

    seat: int


class Opened(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: a class for this world alone."""

    code: Code
    name: str


class Closed(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: that class is over."""

    code: str


class Stopped(msgspec.Struct, tag=True, frozen=True):
    """Answer to the classroom's ``Stop``: the reason of a failure, or empty."""

    id: int
    why: str = ""


class SignIn(msgspec.Struct, tag=True, frozen=True):
    """Message to the classroom: a pupil signs in with a class's code."""

    id: int
    code: str
    name: str


class Admitted(msgspec.Struct, tag=True, frozen=True):
    """Answer of the classroom to ``SignIn``: a refusal, or a ``Place``."""

    id: int
    why: str = ""
    code: str = ""
    page: str = ""
    seconds: float = 0.0


class Ended(msgspec.Struct, tag=True, frozen=True):
    """Message of the classroom: a class is over."""

    code: str


class News(msgspec.Struct, tag=True, frozen=True):
    """Message of the classroom for a page."""

    seat: int
    message: dict[str, object]


class Stop(msgspec.Struct, tag=True, frozen=True):
    """Message of the classroom: stop all programs and motion of a robot."""

    id: int
    robot: str


ToRoom = Hello | PageRequest | At | Drawn | Left | Opened | Closed | Stopped | SignIn
FromRoom = News | Stop | Admitted | Ended
_decode = msgspec.json.Decoder(FromRoom).decode


def put(message: ToRoom | FromRoom, writer: asyncio.StreamWriter) -> None:
    """Send a message as a line of JSON, and hang up on an end that does not read."""
    if not writer.is_closing():
        writer.write(msgspec.json.encode(message) + b"\n")
        if writer.transport.get_write_buffer_size() > UNREAD_MAX:
            writer.transport.abort()


class LinkedRoom:
    """The classroom at ``path``, for the console of one world.

    ``stop`` ends all programs and motion of a robot; ``ended`` is called with the code of a class that is over.
    """

    def __init__(
        self, path: Path, hello: Hello, stop: Callable[[str], Awaitable[None]], ended: Callable[[str], None]
    ) -> None:
        self._path, self._hello, self._stop, self._ended = path, hello, stop, ended
        self._admitting: dict[int, asyncio.Future[Admitted]] = {}
        self._seats: dict[int, LinkedSeat] = {}
        self._next = 1
        self._writer: asyncio.StreamWriter | None = None
        self._stopping: set[asyncio.Task[None]] = set()
        self._task = asyncio.get_running_loop().create_task(self._run(), name="classroom of several worlds")

    def seat(self, post: Tell) -> LinkedSeat:
        """Return a place for a page."""
        self._next += 1
        return LinkedSeat(self, self._next, post)

    async def open(self, code: str, name: str) -> None:
        """Open a class for this program's own world. Raises Refused."""
        self.send(Opened(code, name))

    async def close(self, code: str) -> None:
        """End a class. Raises Refused."""
        self.send(Closed(code))

    async def admit(self, code: str, name: str) -> Place:
        """Return the world of a pupil with a class's code. Raises NotFound, Refused."""
        if len(self._admitting) >= ADMITTING_MAX:
            raise Refused("too many sign in at once")
        self._next += 1
        id = self._next
        self.send(SignIn(id, code, name))
        self._admitting[id] = asyncio.get_running_loop().create_future()
        try:
            async with asyncio.timeout(ADMIT_SECONDS):
                found = await self._admitting[id]
        except TimeoutError:
            raise Refused("the class does not answer") from None
        finally:
            del self._admitting[id]
        if found.why:
            raise NotFound(found.why)
        return Place(found.code, found.page, found.seconds)

    async def end(self) -> None:
        """Hang up."""
        self._task.cancel()
        await asyncio.gather(self._task, *self._stopping, return_exceptions=True)

    def send(self, message: ToRoom, seat: LinkedSeat | None = None) -> None:
        """Send a message to the classroom. Raises Refused if it cannot be reached."""
        if self._writer is None or self._writer.is_closing():
            raise Refused("the class is out of reach")
        if seat is not None:
            self._seats[seat.number] = seat
        put(message, self._writer)

    def forget(self, seat: LinkedSeat) -> None:
        """Remove the seat of a page that has gone."""
        if self._seats.pop(seat.number, None) is not None and self._writer is not None:
            put(Left(seat.number), self._writer)

    async def _run(self) -> None:
        while True:
            try:
                await self._talk()
            except (OSError, ValueError, msgspec.MsgspecError, RecursionError) as error:
                log.warning("the class is out of reach: %s", error)
            await asyncio.sleep(AGAIN)

    async def _talk(self) -> None:
        reader, writer = await asyncio.open_unix_connection(self._path, limit=LINE_MAX)
        try:
            put(self._hello, writer)
            self._writer = writer
            while text := await reader.readline():
                self._on_message(_decode(text))
        finally:
            self._writer = None
            writer.transport.abort()
            seats, self._seats = self._seats, {}
            for seat in seats.values():
                seat.post({"type": "left"})

    def _on_message(self, message: FromRoom) -> None:
        match message:
            case Stop():
                task = asyncio.get_running_loop().create_task(self._do_stop(message), name=f"stop {message.robot}")
                self._stopping.add(task)
                task.add_done_callback(self._stopping.discard)
            case News(seat=number, message=news):
                if (seat := self._seats.get(number)) is not None:
                    seat.post(news)
            case Admitted(id=id):
                if (waiting := self._admitting.get(id)) is not None and not waiting.done():
                    waiting.set_result(message)
            case Ended(code=code):
                self._ended(code)

    async def _do_stop(self, request: Stop) -> None:
        why = ""
        try:
            await self._stop(request.robot)
        except (RobotError, OSError) as error:
            why = f"{request.robot}: {error}"
        if self._writer is not None:
            put(Stopped(request.id, why), self._writer)


class LinkedSeat:
    """One page's seat in the classroom, taken with the page's first request."""

    def __init__(self, room: LinkedRoom, number: int, post: Tell) -> None:
        self._room, self.number, self.post = room, number, post
        self._robot = ""
        self._gone = False

    async def take(self, request: Member, *, may_teach: bool) -> None:
        """Pass a request on, unless the page has gone; ``post`` gets the result.

        Raises Refused if the classroom is out of reach.
        """
        if self._gone:
            return
        self._room.send(At(self.number, self._robot), self)
        self._room.send(PageRequest(self.number, request, may_teach), self)

    def at(self, robot: str) -> None:
        """Set the page's robot, reported with its next request."""
        self._robot = robot

    def draw(self, picture: str) -> None:
        """Show teachers the robot's map, a PNG in base64, unless the page has gone. Raises Refused."""
        if not self._gone:
            self._room.send(Drawn(self.number, picture), self)

    def close(self) -> None:
        """Leave the classroom with the page."""
        self._gone = True
        self._room.forget(self)
