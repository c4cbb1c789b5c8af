"""Where the owner of this machine sees who moves each robot, takes control, gives it and releases it.

A socket in the data folder that only its owner can open; a line of JSON comes, a line of JSON goes. Knows no door.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Literal

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.model.components.system.lease import PERSON, Lease
from roboglot.model.components.system.link import Link
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot

NAME = "lease.sock"  # in the data folder


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
        self._robots = robots
        self._server = LocalServer(folder / NAME, "roboglot lease", self._answer)

    async def open(self) -> None:
        """Listen. Where that cannot be the robots can still be used, and a warning says so."""
        await self._server.open()

    async def close(self) -> None:
        """Stop listening."""
        await self._server.close()

    async def _answer(self, line: bytes) -> bytes:
        error = ""
        try:
            request = msgspec.json.decode(line, type=Request)
            if request.do != "look":
                await self._grant(request)
        except (msgspec.DecodeError, RobotError, LookupError) as refused:
            error = str(refused.args[0]) if refused.args else type(refused).__name__
        return msgspec.json.encode(Answer([_control(name, robot) for name, robot in self._robots.items()], error))

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
