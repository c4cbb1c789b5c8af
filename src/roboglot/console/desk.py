"""Desk: the console's parts, and the common path of all requests of pages and scripts."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from roboglot.console import drawings
from roboglot.console.studio.programs import Studio
from roboglot.console.verbs import maps as map_verbs
from roboglot.console.verbs.clock import CLOCK_VERBS
from roboglot.console.verbs.robots import VERBS
from roboglot.console.verbs.world import WORLD_VERBS
from roboglot.console.views import RobotView
from roboglot.model.admission import Right
from roboglot.model.client_context import identity
from roboglot.model.clock import Clock, RealClock
from roboglot.model.components.system.lease import Lease
from roboglot.model.errors import Forbidden, NotFound, Refused
from roboglot.model.robot import Robot
from roboglot.model.stage import Stage
from roboglot.operations import BadParameters, Operation
from roboglot.protocols.door import Endpoint
from roboglot.spelling import meant
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.console.recordings.running import Recordings

CLIENT = "console"
COMMAND = "command"  # the kind of recorded inputs for commands
TAKE = "take_control"  # handled separately because it concerns the caller
STOP = "stop"  # ends programs, too: their next statement would move the robot again
# Commands that also work while the robot is off or restarts. What others set would be lost when it starts.
HOLD = frozenset({"stop", "cancel", "emergency_stop", "give_control", "release_control", "dismiss_fault"})
assert map_verbs  # importing it registers its verbs


@dataclass(frozen=True, slots=True)
class World:
    """World of the robots: name, version of roboglot, clock, initial seed, bodies."""

    name: str
    version: str
    clock: Clock
    seed: int = 1
    bodies: Mapping[str, str] = field(default_factory=dict)


@dataclass(slots=True)
class Desk:
    """Desk of one console. ``doors``: endpoints of each robot's doors. ``running``: number of running programs."""

    world: World
    robots: Mapping[str, Robot]
    stage: Stage
    doors: Callable[[], Mapping[str, Sequence[Endpoint]]]
    studio: Studio = field(default_factory=Studio)
    running: Callable[[], int] = lambda: 0
    recordings: Recordings | None = None
    sessions: Path | None = None  # file of signed-in browsers, with access control
    views: dict[str, RobotView] = field(init=False)
    pupils: set[str] = field(default_factory=set)  # identities of the pupils in the open class
    locked: set[str] = field(default_factory=set)  # robots that only a teacher may move

    def __post_init__(self) -> None:
        self.views = {name: RobotView(robot, self.stage) for name, robot in self.robots.items()}

    @property
    def first(self) -> Robot:
        """A robot, for what all robots of a program share."""
        return next(iter(self.robots.values()))

    @property
    def visible(self) -> dict[str, RobotView]:
        """Views of the robots that the current client may see, by name."""
        return {name: view for name, view in self.views.items() if view.robot.admission.may(Right.SEE)}

    def view(self, name: str, verb: str = "look") -> RobotView:
        """Return one robot's view. Raises NotFound, Forbidden."""
        if name not in self.views:
            raise NotFound(f"there is no robot {name!r}; there are {', '.join(self.visible)}")
        view = self.views[name]
        view.robot.admission.check(CLIENT, verb, Right.SEE)
        return view

    @property
    def may_teach(self) -> bool:
        """True if the current client has ADMIN on every robot and is not a pupil."""
        return identity() not in self.pupils and self.may_change_world

    @property
    def may_change_world(self) -> bool:
        """True if the current client has ADMIN on every robot."""
        return all(robot.admission.may(Right.ADMIN) for robot in self.robots.values())

    def check(self, robot: Robot, verb: str, right: Right | None) -> None:
        """Raise Forbidden unless the current client may do ``verb`` with the robot now."""
        robot.admission.check(CLIENT, verb, right)
        if robot.id in self.locked and right is not Right.SEE and not self.may_teach:
            raise Forbidden(f"the teacher has locked robot {robot.id}")

    @property
    def pace(self) -> dict[str, object]:
        """Pace of time: ``speed``, ``paused``, ``lockstep`` (True if a program advances the clock), and ``seed``.

        ``behind``: s by which robot time fell behind on a machine that is too slow.
        """
        clock, seed = self.world.clock, self.stage.seed
        if not isinstance(clock, RealClock):
            return {"lockstep": True, "speed": 1.0, "paused": False, "seed": seed, "behind": 0.0}
        pace: dict[str, object] = {"lockstep": False, "speed": clock.speed, "paused": clock.paused, "seed": seed}
        return pace | {"behind": round(clock.behind, 1)}

    def hello(self) -> dict[str, object]:
        """First message to a page."""
        visible = self.visible
        whole = len(visible) == len(self.views)
        simulated = {placed.name for placed in self.stage.robots}
        return {
            "version": self.world.version,
            "world": self.world.name,
            "pace": self.pace,
            "robots": [
                {"name": name, "simulated": name in simulated, "rights": self._rights(view.robot)}
                for name, view in visible.items()
            ],
            "needs": self._needs(),
            "all": self.may_change_world,
            "teacher": self.may_teach,
            "doors": {
                name: [[e.label, e.address, e.try_line] for e in listed]
                for name, listed in self.doors().items()
                if name in visible
            },
            "whole": whole,  # sees all robots, so the world, too
            "floors": drawings.plans_of(self.stage) if whole else [],
            "fault_kinds": [
                {"name": k.name, "of_robot": k.of_robot, "options": dict(k.options)} for k in self.stage.fault_kinds
            ],
        }

    @staticmethod
    def _needs() -> dict[str, str]:
        """Return the right that each verb needs; "all": to admin on all robots."""
        own = {operation.key: str(operation.right or Right.ADMIN) for operation in VERBS}
        of_all = {operation.key: "all" for operation in (*WORLD_VERBS, *CLOCK_VERBS)}
        of_pages = {"program": Right.PROGRAM, "resend": Right.ADMIN, "record": "all", "teach": "all"}
        return own | of_all | of_pages | {TAKE: Right.DRIVE}

    @staticmethod
    def _rights(robot: Robot) -> list[str]:
        return [right for right in Right if robot.admission.may(right)]

    def admitted(self, name: str, verb: str) -> Robot:
        """Return the robot if the current client may call the verb now. Raises NotFound, Forbidden."""
        robot = self.view(name, verb).robot
        if verb == TAKE:
            self.check(robot, verb, Right.DRIVE)
        elif (operation := VERBS.get(verb)) is None:
            raise NotFound(f"there is no verb {verb!r}{meant(verb, {TAKE, *(each.key for each in VERBS)})}")
        else:
            self.check(robot, verb, operation.right)
        return robot

    async def command(self, name: str, verb: str, values: Mapping[str, object], client: str) -> Any:
        """Call a robot's verb and return its result. Raises NotFound, BadParameters and the robot's errors."""
        robot = self.admitted(name, verb)
        if verb == TAKE:
            if values:
                raise BadParameters(f"{next(iter(values))} is unknown")
            with robot.admission.noting(CLIENT, verb), self._input(robot, verb, values, client):
                return await robot[Lease].take(client)
        operation = VERBS[verb]
        if operation.right is Right.SEE:
            return await operation.call(robot, values)
        with robot.admission.noting(CLIENT, verb), self._input(robot, verb, values, client):
            if robot.starts.down and verb not in HOLD:
                raise Refused(robot.starts.down)
            programs = self.studio.programs.get(name) if verb == STOP and not values else None
            if programs is None:
                return await operation.call(robot, values)
            ending = programs.end_all(why="ended by Stop")
            ends = await asyncio.gather(operation.call(robot, values), ending, return_exceptions=True)
            await operation.call(robot, values)  # what the programs began until then
            for error in filter(None, ends):
                raise error
            return None

    @staticmethod
    def _input(
        robot: Robot, verb: str, values: Mapping[str, object], client: str
    ) -> contextlib.AbstractContextManager[None]:
        return robot.inputs.noting(COMMAND, verb, {"values": dict(values), "by": client})

    @contextlib.contextmanager
    def noting(self, what: str) -> Iterator[None]:
        """Context that audits the outcome of an operation on all robots."""
        with contextlib.ExitStack() as stack:
            for robot in self.robots.values():
                stack.enter_context(robot.admission.noting(CLIENT, what))
            yield

    def world_file(self) -> str:
        """Return the current state of the simulated world as a world file. Raises Forbidden."""
        self.check_all("save the world", Right.SEE)
        return self.stage.world_file()

    def world_operation(self, verb: str) -> Operation[str]:
        """Return a verb of the world that the current client may call now. Raises NotFound, Forbidden."""
        operation = WORLD_VERBS.get(verb) or CLOCK_VERBS.get(verb)
        if operation is None:
            verbs = {each.key for each in (*WORLD_VERBS, *CLOCK_VERBS)}
            raise NotFound(f"there is no verb {verb!r} for the world{meant(verb, verbs)}")
        self.check_all(verb, operation.right)
        return operation

    def check_all(self, verb: str, right: Right | None) -> None:
        """Raise Forbidden unless the current client has the right on every robot: everyone in a world shares it."""
        for robot in self.robots.values():
            robot.admission.check(CLIENT, verb, right)

    async def change_world(self, verb: str, values: Mapping[str, object]) -> object:
        """Change the simulated world. Raises NotFound, BadParameters, ValueError in plain words."""
        operation = self.world_operation(verb)
        with self.noting(verb):
            return await self._change_world(operation, values)

    async def _change_world(self, operation: Operation[str], values: Mapping[str, object]) -> object:
        if operation.key not in CLOCK_VERBS:
            return await operation.call(self.stage, values)
        if real := sorted(self.robots.keys() - {placed.name for placed in self.stage.robots}):
            raise Refused(f"{', '.join(real)}: real robots do not stop with the clock")
        return await operation.call(self.world.clock, values)
