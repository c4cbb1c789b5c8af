"""The classroom that the consoles of a fleet's worlds share: a world for each pupil, one grid for the teacher.

It runs in the supervisor, so that it outlives a dead world, and listens in the fleet's folder.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import Coroutine
from pathlib import Path

import msgspec

from roboglot.console.studio.class_files import ClassFiles
from roboglot.console.studio.class_link import (
    LINE_MAX,
    Admitted,
    At,
    Closed,
    Drawn,
    Ended,
    Hello,
    Left,
    News,
    Opened,
    PageRequest,
    SignIn,
    Stop,
    Stopped,
    ToRoom,
    put,
)
from roboglot.console.studio.classroom import Classroom, Seat, World
from roboglot.model.errors import Refused, RobotError
from roboglot.shards.shard import CLASS_SOCKET
from roboglot.transport.log_limiter import LogLimiter

log = logging.getLogger(__name__)
BROKEN = OSError, ValueError, msgspec.MsgspecError, RecursionError  # by what a console sends
FOLDER = "classes"
PENDING_MAX = 256  # requests of one world in progress
SEATS_MAX = 200  # pages per world
NAMELESS_MAX = 32  # connections that have not sent the name of their world
NAMELESS_SECONDS = 10.0  # for it to arrive
BUSY = "too much is being answered"
STOP_SECONDS = 10.0
_decode = msgspec.json.Decoder(ToRoom).decode


class FleetClasses:
    """Classes of the fleet in one folder."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._server: asyncio.Server | None = None
        self._worlds: set[asyncio.Task[None]] = set()
        self._nameless = 0
        self._limited = LogLimiter(log)

    async def open(self) -> None:
        """Listen. On failure, log a warning; worlds then run without classes."""
        path = self._folder / CLASS_SOCKET
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            room = await asyncio.to_thread(Classroom, ClassFiles(self._folder / FOLDER))
            path.unlink(missing_ok=True)  # left by a killed program; no other program uses the folder
            os.fchmod(listening.fileno(), 0o600)
            listening.bind(bytes(path))

            async def serve(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
                task = asyncio.current_task()
                assert task is not None
                self._worlds.add(task)
                task.add_done_callback(self._worlds.discard)
                with contextlib.suppress(asyncio.CancelledError):  # of `close`; asyncio's streams would log it
                    await self._serve(room, reader, writer)

            self._server = await asyncio.start_unix_server(serve, sock=listening, limit=LINE_MAX)
        except OSError as error:
            listening.close()
            log.warning("cannot open classes in this fleet: %s: %s", path, error)

    async def _serve(self, room: Classroom, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        world = ""
        try:
            if (hello := await self._name(reader)) is not None:
                world = hello.world
                await _Link(room, writer, hello).serve(reader)
        except BROKEN as error:
            self._limited.warning(world, "disconnected world %s: %s", world, error)
        finally:
            writer.transport.abort()

    async def _name(self, reader: asyncio.StreamReader) -> Hello | None:
        """Return a console's first message; None if it is another, or none comes in time."""
        if self._nameless >= NAMELESS_MAX:
            return None
        self._nameless += 1
        fault = "it sent no name"
        try:
            async with asyncio.timeout(NAMELESS_SECONDS):
                hello = _decode(await reader.readline())
            if isinstance(hello, Hello):
                return hello
        except BROKEN as error:
            fault = str(error) or fault
        finally:
            self._nameless -= 1
        self._limited.warning("", "disconnected a world: %s", fault)
        return None

    async def close(self) -> None:
        """Stop listening and hang up."""
        if self._server is None:
            return
        self._server.close()
        for task in list(self._worlds):
            task.cancel()
        await asyncio.gather(*self._worlds, return_exceptions=True)
        (self._folder / CLASS_SOCKET).unlink(missing_ok=True)


class _Link:
    """One world's console."""

    def __init__(self, room: Classroom, writer: asyncio.StreamWriter, hello: Hello) -> None:
        self._room, self._writer = room, writer
        self._world, self._page = hello.world, hello.page
        self._seats: dict[int, Seat] = {}
        self._stops: dict[int, asyncio.Future[str]] = {}
        self._pending: set[asyncio.Task[None]] = set()

    async def serve(self, reader: asyncio.StreamReader) -> None:
        """Serve until the console hangs up. Raises one of BROKEN if it sends nonsense."""
        mine = self._room.worlds[self._world] = World(self._world, self._page, self._stop, self._end)
        try:
            while text := await reader.readline():
                await self._on_message(_decode(text))
        finally:
            if self._room.worlds.get(self._world) is mine:
                del self._room.worlds[self._world]
            for seat in self._seats.values():
                seat.close()
            for waiting in self._stops.values():
                waiting.cancel()
            for task in self._pending:
                task.cancel()

    async def _on_message(self, message: ToRoom) -> None:
        match message:
            case Opened() | Closed():
                await self._change(message)
            case SignIn(id=id) if len(self._pending) >= PENDING_MAX:
                put(Admitted(id, BUSY), self._writer)
            case SignIn():
                self._begin(self._admit(message), "admit a pupil")
            case Stopped(id=id, why=why):
                if (waiting := self._stops.get(id)) is not None and not waiting.done():
                    waiting.set_result(why)
            case Hello():
                raise ValueError("it sent its name twice")
            case _:
                self._on_page_message(message)

    def _on_page_message(self, message: PageRequest | At | Drawn | Left) -> None:
        match message:
            case PageRequest():
                self._take(self._seat(message.seat), message)
            case At(seat=number, robot=robot):
                self._seat(number).at(robot)
            case Drawn(seat=number, png=png):
                self._seat(number).draw(png)
            case Left(seat=number):
                if (seat := self._seats.pop(number, None)) is not None:
                    seat.close()

    async def _change(self, message: Opened | Closed) -> None:
        """Open or close the class of one world."""
        found = self._room.classes.get(message.code)
        if isinstance(message, Closed):
            if found is not None and found.only == self._world:
                await self._room.end(message.code)
        elif found is None:
            with contextlib.suppress(Refused):  # too many: the console's own class stays open
                await self._room.begin(message.name, message.code, self._world)

    def _seat(self, number: int) -> Seat:
        if number not in self._seats:
            if len(self._seats) >= SEATS_MAX:
                raise ValueError(f"more than {SEATS_MAX} pages")
            self._seats[number] = self._room.seat(lambda news: self._send(number, news), self._world)
        return self._seats[number]

    def _take(self, seat: Seat, requested: PageRequest) -> None:
        if len(self._pending) >= PENDING_MAX:
            seat.post({"type": "refused", "id": requested.request.id, "why": BUSY})
            return

        async def take() -> None:
            try:
                await seat.take(requested.request, may_teach=requested.may_teach)
            except (RobotError, ValueError) as error:
                seat.post({"type": "refused", "id": requested.request.id, "why": str(error)})

        self._begin(take(), f"class {requested.request.do}")

    def _begin(self, what: Coroutine[None, None, None], name: str) -> None:
        task = asyncio.get_running_loop().create_task(what, name=name)
        self._pending.add(task)
        task.add_done_callback(self._pending.discard)

    async def _admit(self, request: SignIn) -> None:
        try:
            place = await self._room.admit(request.code, request.name, self._world)
            answer = Admitted(request.id, "", place.code, place.page, place.seconds)
        except RobotError as error:
            answer = Admitted(request.id, str(error))
        put(answer, self._writer)

    def _end(self, code: str) -> None:
        """Report the end of a class."""
        put(Ended(code), self._writer)

    def _send(self, number: int, message: dict[str, object]) -> None:
        if number in self._seats:
            put(News(number, message), self._writer)

    async def _stop(self, robot: str) -> None:
        """Stop all programs and motion of a robot. Raises Refused."""
        id = max(self._stops, default=0) + 1
        self._stops[id] = asyncio.get_running_loop().create_future()
        try:
            put(Stop(id, robot), self._writer)
            async with asyncio.timeout(STOP_SECONDS):
                why = await self._stops[id]
        except (TimeoutError, OSError):
            why = f"{robot} in {self._world} does not answer"
        finally:
            del self._stops[id]
        if why:
            raise Refused(why)
