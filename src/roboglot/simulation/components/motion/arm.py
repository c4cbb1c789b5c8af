"""An arm in a vertical plane: its end point moves in straight lines over time; the linkage is not modelled."""

from __future__ import annotations

import math

from msgspec import Struct

from roboglot.model.actions import Action
from roboglot.model.components.motion.arm import ARM, Arm, ArmPosition, ArmReach
from roboglot.model.errors import InvalidGoal
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import Axis, move
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Offset, Pair, Positive
from roboglot.simulation.bodies.schedule import Duty


class ArmSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Place of the shoulder, and the end point's reach from there (x forward, z up), m."""

    forward: Offset
    above_belly: Offset
    lowest: Pair
    highest: Pair
    radius: Positive
    home: Pair
    speed: Positive
    acceleration: Positive


class SimulatedArm(Arm):
    """Arm with one axis along the straight way to the goal, which stays inside the convex reach."""

    def __init__(self, section: ArmSection, hull: Hull, robot: Robot) -> None:
        self.reach = ArmReach(ArmPosition(*section.lowest), ArmPosition(*section.highest), section.radius)
        self.home = ArmPosition(*section.home)
        self._section, self._hull, self._robot = section, hull, robot
        self._from = self._to = self.home
        self._way = Axis(0.0, math.inf, section.acceleration)
        self.moving = Duty()

    @property
    def position(self) -> ArmPosition:
        start, end, length = self._from, self._to, self._length
        part = self._way.position / length if length else 1.0
        return ArmPosition(start.x + (end.x - start.x) * part, start.z + (end.z - start.z) * part)

    @property
    def mount(self) -> tuple[float, float, float]:
        """Position of the end point in base_link, m."""
        at = self.position
        return self._section.forward + at.x, 0.0, self._hull.belly + self._section.above_belly + at.z

    def move_to(self, position: ArmPosition, *, source: str = "") -> Action:
        self._check(position)
        return self._start("move arm", position, source)

    def move_by(self, offset: ArmPosition, *, source: str = "") -> Action:
        now = self.position
        goal = ArmPosition(now.x + offset.x, now.z + offset.z)
        self._check(goal)
        return self._start("move arm", goal, source)

    def recenter(self, *, source: str = "") -> Action:
        return self._start("recenter arm", self.home, source)

    def stop(self) -> None:
        for action in self._robot.actions.running(ARM):
            action.cancel("the arm was stopped")
        self._halt()

    def control(self, seconds: float) -> None:
        """Move along the way."""
        if self.moving.on:
            self._way.approach(self._length, self._section.speed, seconds)

    @property
    def _length(self) -> float:
        return math.hypot(self._to.x - self._from.x, self._to.z - self._from.z)

    def _start(self, name: str, goal: ArmPosition, source: str) -> Action:
        async def run(action: Action) -> None:
            def begin() -> None:
                self._from, self._to = self.position, goal
                self._way.position = self._way.rate = 0.0
                self.moving.begin()

            await move(action, self._robot.clock, begin, lambda: self._way.position == self._length, self._halt)

        return self._robot.actions.start(name, run, resources={ARM}, goal=goal, source=source, pausable=True)

    def _halt(self) -> None:
        self.moving.end()
        self._way.rate = 0.0

    def _check(self, goal: ArmPosition) -> None:
        low, high = self.reach.lowest, self.reach.highest
        inside = low.x - 1e-9 <= goal.x <= high.x + 1e-9 and low.z - 1e-9 <= goal.z <= high.z + 1e-9
        if not inside or not math.hypot(goal.x, goal.z) <= self.reach.radius + 1e-9:
            raise InvalidGoal(
                f"the arm reaches x {low.x:g} to {high.x:g} m, z {low.z:g} to {high.z:g} m "
                f"and {self.reach.radius:g} m from the shoulder, not ({goal.x:.4g}, {goal.z:.4g})"
            )


def _fit(fit: Fitting) -> SimulatedArm:
    return SimulatedArm(fit.body[ArmSection], fit.hull, fit.robot)


PART = Part(
    name="arm", interface=Arm, section=ArmSection, fit=_fit, control=SimulatedArm.control, duty=lambda arm: arm.moving
)
