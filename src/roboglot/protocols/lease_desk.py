"""Where the owner of this machine sees who moves each robot, takes control, gives it and releases it.

A socket in the data folder that only its owner can open; a line of JSON comes, a line of JSON goes. Knows no door.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import os
import socket
from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import msgspec

from roboglot.model.components.system.lease import PERSON, Lease
from roboglot.model.components.system.link import Link
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
NAME = "lease.sock"  # in the data folder
LINE_MAX = 1024  # bytes of a request
CALLERS_MAX = 8
PATH_MAX = 107  # bytes of a socket's path, as the system has it


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """What is wished; ``robot`` is needed but to look, ``who`` is whom control is given to."""

    do: Literal["look", "take", "give", "release"] = "look"
    robot: str = ""
    who: str = ""


class Control(msgspec.Struct):
    """Of one robot: who moves it now and by what, who alone may (empty: nobody, whoever comes), who moved it last.

    ``link`` is how the link to a real robot is; empty for a simulated one. ``seconds`` are robot time.
    """

    robot: str
    holder: str
    doing: str
    seconds: float
    taken_by: str
    last: str
    link: str


class Answer(msgspec.Struct):
    """How all robots are now, and why the wish was not granted (empty: it was)."""

    robots: list[Control]
    error: str = ""


class LeaseDesk:
    """For all robots of one program."""

    def __init__(self, folder: Path, robots: Mapping[str, Robot]) -> None:
        self._path, self._robots = folder / NAME, robots
        self._server: asyncio.Server | None = None
        self._callers: set[asyncio.StreamWriter] = set()

    async def open(self) -> None:
        """Listen. Where that cannot be the robots can still be used, and a warning says so."""
        listening = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
        try:
            self._path.unlink(missing_ok=True)  # left by a program that was killed; the folder is ours alone
            if len(bytes(self._path)) > PATH_MAX:
                raise OSError("its path is too long")
            os.fchmod(listening.fileno(), 0o600)  # before it has a name, so that nobody else ever can
            listening.bind(bytes(self._path))
            self._server = await asyncio.start_unix_server(self._receive, sock=listening, limit=LINE_MAX)
        except OSError as error:
            listening.close()
            log.warning("`roboglot lease` cannot reach this program: %s: %s", self._path, error)

    async def close(self) -> None:
        """Stop listening."""
        if self._server is None:
            return
        self._server.close()
        for caller in self._callers:
            caller.transport.abort()
        self._path.unlink(missing_ok=True)

    async def _receive(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._callers.add(writer)
        try:
            while len(self._callers) <= CALLERS_MAX and (line := await reader.readline()):
                writer.write(msgspec.json.encode(await self._answer(line)) + b"\n")
                await writer.drain()
        except (ValueError, OSError):  # a line that is too long; the caller is gone
            pass
        finally:
            self._callers.discard(writer)
            writer.transport.abort()
            with contextlib.suppress(OSError):
                await writer.wait_closed()

    async def _answer(self, line: bytes) -> Answer:
        error = ""
        try:
            request = msgspec.json.decode(line, type=Request)
            if request.do != "look":
                await self._grant(request)
        except (msgspec.DecodeError, RobotError, LookupError) as refused:
            error = str(refused.args[0]) if refused.args else type(refused).__name__
        return Answer([_control(name, robot) for name, robot in self._robots.items()], error)

    async def _grant(self, request: Request) -> None:
        robot = self._robots.get(request.robot)
        if robot is None:
            raise LookupError(f"there is no robot {request.robot!r}; there are {', '.join(self._robots)}")
        match request.do:
            case "release":
                await robot[Lease].release()
            case "give":
                await robot[Lease].take(request.who)
            case _:
                await robot[Lease].take(PERSON)


def _control(name: str, robot: Robot) -> Control:
    lease, now = robot[Lease], robot.clock.time()
    holder = lease.holder
    return Control(
        robot=name,
        holder=holder.who if holder else "",
        doing=holder.doing if holder else "",
        seconds=now - holder.since if holder else 0.0,
        taken_by=lease.taken_by,
        last=lease.last.who,
        link=_link_in_words(robot[Link]) if Link in robot else "",
    )


def _link_in_words(link: Link) -> str:
    return f"{link.state}: {link.reason}" if link.reason else str(link.state)
