"""Repeats, in a rerun, recorded external inputs: interventions, commands at the console, answers."""

from __future__ import annotations

import asyncio
import contextlib
import os
from collections.abc import Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, cast

import msgspec

from roboglot.console import desk, program_runs, teleop
from roboglot.control import lease_server
from roboglot.model.client_context import set_client
from roboglot.model.errors import RobotError
from roboglot.model.inputs import noted_stage
from roboglot.model.inputs.external import ANSWER, Input
from roboglot.operations import BadParameters
from roboglot.programs.errors import ProgramError
from roboglot.protocols.robomaster.ports import pilot_port
from roboglot.recording.lines import Answers, Line, TextLine

if TYPE_CHECKING:
    from roboglot.protocols.robot_doors import RobotDoors
    from roboglot.protocols.ros2.server import Ros2Door
    from roboglot.runtime import Runtime


class Ros2Line(Line):
    """Messages for the ROS 2 door, passed directly: a Zenoh router between would only add time."""

    def __init__(self, doors: RobotDoors) -> None:
        self._doors = doors

    async def open(self) -> None:
        """Do nothing: there is no connection."""

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:  # noqa: ARG002
        """Pass one message to the door; ``operation``: its topic's key."""
        door = cast("Ros2Door", self._doors.door("ros2"))
        door.receive(operation, payload)
        return []

    async def close(self) -> None:
        """Do nothing."""


class SerialTextLine(TextLine):
    """A client at the end of a serial line."""

    comes = False  # the line itself is the robot's client, from its start on

    def __init__(self, link: Path) -> None:
        self._link = link

    async def open(self) -> None:
        """Open the terminal. Raises OSError."""
        self._end = os.open(self._link, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._closed = asyncio.Event()

    async def request(self, operation: str, payload: bytes, answers: Sequence[bytes]) -> Answers:  # noqa: ARG002
        """Send one command; its answer is drained."""
        os.write(self._end, payload.rstrip(b" ;") + b";")
        return []

    async def drain(self) -> None:
        """Read and discard the robot's output."""
        loop = asyncio.get_running_loop()
        loop.add_reader(self._end, os.read, self._end, 1 << 16)
        await self._closed.wait()

    async def close(self) -> None:
        """Close this end."""
        asyncio.get_running_loop().remove_reader(self._end)
        os.close(self._end)
        self._closed.set()


class Repeater:
    """Repeater of one runtime's inputs; its robots make no further calls by themselves."""

    def __init__(self, runtime: Runtime) -> None:
        self._runtime, self._robots = runtime, runtime.fleet.robots
        for robot in self._robots.values():
            robot.inputs.play()

    @cached_property
    def _desk(self) -> desk.Desk:
        return self._runtime.build_desk()

    async def __call__(self, given: Input) -> bool:
        """Repeat an input, even a refused one; return False if the robot does not wait for that answer yet."""
        if given.kind == ANSWER:
            return self._answer(given)
        set_client(given.client, given.connection)
        with contextlib.suppress(RobotError, BadParameters, ProgramError, LookupError, ValueError):
            await self._do(given, cast(Mapping[str, str], given.values))
        return True

    def _answer(self, given: Input) -> bool:
        inputs, number = self._robots[given.robot].inputs, int(str(given.values["number"]))
        if not inputs.waits(given.name, number):
            return False
        inputs.answer(given.name, number, str(given.values["said"]))
        return True

    async def _do(self, given: Input, values: Mapping[str, str]) -> None:
        match given.kind:
            case noted_stage.STAGE:
                noted_stage.do_again(self._runtime.fleet.world.stage, given)
            case desk.COMMAND:
                asked = cast(Mapping[str, object], values["values"])
                await self._desk.command(given.robot, given.name, asked, values["by"])
            case program_runs.PROGRAM if given.name == program_runs.END:
                await program_runs.end_all(self._desk, given.robot)
            case program_runs.PROGRAM if given.name == program_runs.DEBUG:
                await program_runs.debug(self._desk.studio.programs[given.robot], values["text"])
            case program_runs.PROGRAM:
                await program_runs.start(self._desk, given.robot, values["source"])
            case teleop.PAD if given.name == "move":
                shares = float(values["x"]), float(values["y"]), float(values["yaw"])
                teleop.Pad(self._robots[given.robot], values["source"]).move(*shares)
            case teleop.PAD:
                teleop.Pad(self._robots[given.robot], values["source"]).let_go(values["why"])
            case pilot_port.PILOT:
                pilot_port.do_again(self._robots[given.robot], given)
            case lease_server.LEASE:
                wish = {"do": given.name, "robot": given.robot, "who": values["who"]}
                request = msgspec.convert(wish, lease_server.Request)
                await self._runtime.leases.do(request, self._robots[given.robot])
