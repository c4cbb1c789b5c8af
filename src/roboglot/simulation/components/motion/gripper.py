"""Two jaws that close until they meet or hold a thing of the world, and carry it."""

from __future__ import annotations

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from roboglot.model.actions import Action
from roboglot.model.components.motion.gripper import GRIPPER, Gripper, GripperStatus, check_level
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import Axis, move
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.building.things import Thing, Things
from roboglot.simulation.components.motion.arm import SimulatedArm

PLAY = 0.001  # m
FRICTION = 0.8  # of both jaws on an object


class GripperSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Opening between the jaws and their length, m; speed (m/s) and force (N) per level."""

    opening: Positive
    fingers: Positive
    speed: Positive
    force: Positive


class SimulatedGripper(Gripper):
    """Gripper at the arm's end point, gripping along the body's y."""

    def __init__(self, section: GripperSection, hull: Hull, arm: SimulatedArm, things: Things, robot: Robot) -> None:
        self._section, self._hull, self._arm, self._things, self._robot = section, hull, arm, things, robot
        self._jaws = Axis(0.0, section.opening, 10.0, position=section.opening)
        self._level = 1
        self._goal: float | None = None
        self.busy = Duty()  # active while the jaws move or hold an object
        self.holds: Thing | None = None  # truth: the object carried
        self._grip: NDArray[np.float64] = np.zeros(3)  # its place in the gripper's frame (base_link's axes)

    @property
    def status(self) -> GripperStatus:
        if self.opening <= PLAY:
            return GripperStatus.CLOSED
        return GripperStatus.OPEN if self.opening >= self._section.opening - PLAY else GripperStatus.BETWEEN

    @property
    def opening(self) -> float:
        return self._jaws.position

    def open(self, level: int = 1, *, source: str = "") -> Action:
        return self._start("open gripper", self._section.opening, level, source)

    def close(self, level: int = 1, *, source: str = "") -> Action:
        return self._start("close gripper", 0.0, level, source)

    def stop(self) -> None:
        for action in self._robot.actions.running(GRIPPER):
            action.cancel("the gripper was stopped")
        self._goal = None

    def control(self, seconds: float) -> None:
        """Move the jaws and the held thing."""
        if self._goal is not None:
            self._move(self._goal, seconds)
        if self.holds is not None:
            middle, grip = self._hull.to_world(np.array((self._arm.mount, self._grip)))
            vx, vy, vz, _ = self._hull.motion
            self.holds.carry(self._hull.position + middle + grip, (vx, vy, vz))
        elif self._goal is None:
            self.busy.end()

    def _start(self, name: str, goal: float, level: int, source: str) -> Action:
        check_level(level)

        async def run(action: Action) -> None:
            def begin() -> None:
                self._goal, self._level = goal, level
                self.busy.begin()

            await move(action, self._robot.clock, begin, lambda: self._goal is None, self._halt)

        return self._robot.actions.start(name, run, resources={GRIPPER}, goal=goal, source=source, pausable=True)

    def _halt(self) -> None:
        self._goal = None
        self._jaws.rate = 0.0

    def _move(self, goal: float, seconds: float) -> None:
        """Move the jaws: a thing between them stops closing jaws, and is dropped by opening ones."""
        self._jaws.approach(goal, self._section.speed * self._level, seconds)
        between = None
        if goal == 0.0:
            between = self.holds or self._between()
            if between and self.opening <= between.diameter:
                self._jaws.position = between.diameter
                self._goal = None
                if self.holds is None:
                    self._take(between)
        elif self.holds and self.opening > self.holds.diameter + PLAY:
            self.holds.drop()
            self.holds = None
        if self.opening == goal:
            self._goal = None

    def _between(self) -> Thing | None:
        """Return the thing between the jaws, if it is not too wide for them."""
        for thing in self._things:
            x, y, z = self._seen(thing).tolist()
            fits = abs(y) + thing.diameter / 2 <= self._section.opening / 2 + PLAY
            if not thing.carried and abs(x) <= self._section.fingers / 2 and fits and -thing.height <= z <= 0.0:
                return thing
        return None

    def _seen(self, thing: Thing) -> NDArray[np.float64]:
        """Return the position of a thing's foot from the end point, along base_link's axes, m."""
        axes = self._hull.to_world(np.eye(3))  # rows: the axes of base_link, world
        seen: NDArray[np.float64] = axes @ (thing.position - self._hull.position) - self._arm.mount
        return seen

    def _take(self, thing: Thing) -> None:
        """Hold a thing, if it is not too heavy for the level."""
        if FRICTION * self._section.force * self._level >= thing.mass * GRAVITY:
            self._grip = self._seen(thing)
            self._grip[1] = 0.0  # the jaws centre the object
            self.holds = thing
            thing.take()


def _fit(fit: Fitting) -> SimulatedGripper:
    arm = fit.get(SimulatedArm)
    return SimulatedGripper(fit.body[GripperSection], fit.hull, arm, fit.world.things, fit.robot)


PART = Part(
    name="gripper",
    interface=Gripper,
    section=GripperSection,
    needs=("arm",),
    fit=_fit,
    after=("arm",),
    control=SimulatedGripper.control,
    control_after=("arm",),
    duty=lambda gripper: gripper.busy,
)
