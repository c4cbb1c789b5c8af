"""Free servos: axes that go to an angle or keep turning."""

from __future__ import annotations

import math

from msgspec import Struct

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.servo import Servos, servo_resource
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import bounded
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import Axis, move
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Count, Positive
from roboglot.simulation.bodies.schedule import Duty


class ServosSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Number of servos, range to both sides (rad), speed (rad/s) and acceleration (rad/s2)."""

    count: Count
    limit: Positive
    speed: Positive
    acceleration: Positive


class SimulatedServos(Servos):
    """Servos that can turn endlessly; only commanded angles are limited."""

    def __init__(self, section: ServosSection, robot: Robot) -> None:
        self.count, self.limit, self.speed = section.count, section.limit, section.speed
        self._robot = robot
        self._axes = [Axis(-math.inf, math.inf, section.acceleration) for _ in range(section.count)]
        self._goals: dict[int, tuple[float, float]] = {}  # index: angle (unwrapped) and top speed
        self._speeds: dict[int, float] = {}
        self.turning = Duty()
        self._turning: dict[int, Action] = {}  # the latest actions of set_speed

    def angle(self, number: int) -> float:
        return _within_a_turn(self._axes[self._index(number)].position)

    def move_to(self, number: int, angle: float, *, speed: float | None = None, source: str = "") -> Action:
        index = self._index(number)
        if not abs(angle) <= self.limit + 1e-9:
            raise InvalidGoal(f"a servo goes to at most {self.limit:.4g} rad, not {angle}")
        if speed is not None and not speed > 0.0:
            raise InvalidGoal(f"a speed must be above 0, not {speed}")
        top = min(speed or self.speed, self.speed)

        async def run(action: Action) -> None:
            axis = self._axes[index]
            # Its angle within one turn: it returns the way it came, not through its stop.
            goal = axis.position - _within_a_turn(axis.position) + angle

            def begin() -> None:
                self._goals[index] = goal, top
                self.turning.begin()

            await move(action, self._robot.clock, begin, lambda: axis.position == goal, lambda: self._halt(index))

        resources = {servo_resource(number)}
        return self._robot.actions.start(
            "move servo", run, resources=resources, goal=angle, source=source, pausable=True
        )

    def set_speed(self, number: int, speed: float, *, source: str = "") -> Action:
        index = self._index(number)
        if not math.isfinite(speed):
            raise InvalidGoal("a speed must be finite")
        cut = float(bounded(speed, self.speed))
        action = self._turning.get(index)
        if action and action.may_go_on(source) and action.status is ActionStatus.EXECUTING and not action.paused:
            action.goal = cut
            return action

        async def run(action: Action) -> None:
            def turn() -> bool:
                assert isinstance(action.goal, float)
                self._speeds[index] = rate = action.goal
                self.turning.begin()
                return rate == 0.0

            await move(action, self._robot.clock, lambda: None, turn, lambda: self._halt(index))

        resources = {servo_resource(number)}
        started = self._robot.actions.start(
            "turn servo", run, resources=resources, goal=cut, source=source, pausable=True
        )
        self._turning[index] = started
        return started

    def stop(self, number: int | None = None) -> None:
        for index in range(self.count) if number is None else (self._index(number),):
            for action in self._robot.actions.running(servo_resource(index + 1)):
                action.cancel("the servo was stopped")
            self._halt(index)

    def control(self, seconds: float) -> None:
        """Turn all servos that have a goal or a speed."""
        for index, (goal, speed) in self._goals.items():
            self._axes[index].approach(goal, speed, seconds)
        for index, rate in self._speeds.items():
            self._axes[index].run(rate, seconds)

    def _halt(self, index: int) -> None:
        self._goals.pop(index, None)
        self._speeds.pop(index, None)
        self._axes[index].rate = 0.0
        if not self._goals and not self._speeds:
            self.turning.end()

    def _index(self, number: int) -> int:
        if not 1 <= number <= self.count:
            raise NotFound(f"there is no servo {number}")
        return number - 1


def _within_a_turn(angle: float) -> float:
    """Return ``angle`` in [-pi, pi]: both ends are distinct positions."""
    return math.remainder(angle, math.tau)


def _fit(fit: Fitting) -> SimulatedServos:
    return SimulatedServos(fit.body[ServosSection], fit.robot)


PART = Part(
    name="servos",
    interface=Servos,
    section=ServosSection,
    fit=_fit,
    control=SimulatedServos.control,
    duty=lambda servos: servos.turning,
)
