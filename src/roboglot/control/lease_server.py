"""Server of ``roboglot lease``, ``stop`` and ``reset``: shows and changes control of the robots of one program.

A socket in the data folder that only its owner can open: one line of JSON per request and answer. Knows the doors'
names only.
"""

from __future__ import annotations

import asyncio
from collections.abc import Collection, Mapping
from functools import partial
from pathlib import Path
from typing import Literal

import msgspec

from roboglot.hosting.local_socket import LocalServer
from roboglot.model.components.system.lease import PERSON, Lease
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.resetting import reset
from roboglot.model.components.system.stopping import stop
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage
from roboglot.spelling import instead
from roboglot.validation import decode_json, why_invalid

NAME = "lease.sock"  # in the data folder
LEASE = "lease"  # the kind of recorded inputs from this socket


class Request(msgspec.Struct, forbid_unknown_fields=True):
    """Request; ``robot``, or ``all``, is required except to look; ``who`` is given control."""

    do: Literal["look", "take", "give", "release", "stop", "reset"] = "look"
    robot: str = ""
    who: str = ""
    all: bool = False


class Control(msgspec.Struct):
    """Control of one robot: current mover and action, exclusive controller (empty: any client), last mover.

    ``link``: state of the link to a real robot; empty for a simulated one. ``seconds``: robot time.
    """

    robot: str
    holder: str
    doing: str
    seconds: float
    taken_by: str
    last: str
    link: str


class Answer(msgspec.Struct):
    """State of all robots, and the reason of a refusal (empty: granted)."""

    robots: list[Control]
    error: str = ""


class LeaseServer(LocalServer):
    """Server for all robots of one program. ``doors``: first words of clients' names; empty: any."""

    def __init__(
        self, folder: Path, robots: Mapping[str, Robot], stage: Stage | None = None, doors: Collection[str] = ()
    ) -> None:
        self._robots, self._stage, self._doors = robots, stage, doors
        super().__init__(folder / NAME, "roboglot lease", self._answer)

    async def _answer(self, line: bytes) -> bytes:
        error = ""
        try:
            request = decode_json(line, Request)
            if request.do != "look":
                await self._grant(request)
        except msgspec.DecodeError as refused:
            error = why_invalid(refused, "the request", wanted=Request)
        except (RobotError, LookupError) as refused:
            error = str(refused.args[0]) if refused.args else type(refused).__name__
        return msgspec.json.encode(Answer([_control(name, robot) for name, robot in self._robots.items()], error))

    async def _grant(self, request: Request) -> None:
        if request.all:
            pending = (self.do(request, robot) for robot in self._robots.values())
            ends = await asyncio.gather(*pending, return_exceptions=True)  # a refusal does not delay the others
            if refused := [f"robot {name}: {end}" for name, end in zip(self._robots, ends, strict=True) if end]:
                raise LookupError("; ".join(refused))
            return
        robot = self._robots.get(request.robot)
        if robot is None:
            raise LookupError(f"there is no robot {request.robot!r}{instead(request.robot, self._robots)}")
        await self.do(request, robot)

    async def do(self, request: Request, robot: Robot) -> None:
        """Execute a request for one robot. Raises LookupError if that is impossible."""
        with robot.inputs.noting(LEASE, request.do, {"who": request.who}):
            await self._do(request, robot)

    async def _do(self, request: Request, robot: Robot) -> None:
        match request.do:
            case "release":
                await robot[Lease].release()
            case "give":
                door = request.who.strip().partition(" ")[0]
                if door and self._doors and door not in self._doors and request.who != robot[Lease].last.who:
                    raise LookupError(f"there is no door {door!r}{instead(door, self._doors)}")
                await robot[Lease].take(request.who)
            case "stop":
                await stop(robot, reason="stopped by the owner of this machine")
            case "reset":
                if self._stage is None or robot.id not in {placed.name for placed in self._stage.robots}:
                    raise LookupError(f"robot {robot.id} is in no simulated world")
                end = partial(robot.actions.cancel, reason="reset by the owner of this machine")
                await reset(robot, self._stage, end)
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
