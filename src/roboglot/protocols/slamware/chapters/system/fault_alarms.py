"""Alarms about faults that clients see as errors."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.clock import Timer
from roboglot.model.components.system.health import Fault, Health
from roboglot.model.events import FaultRaised
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.system.fault_numbers import LASTING, is_error


class FaultAlarms:
    """Calls ``alarm`` with the robot time of each error, once it counts as one."""

    def __init__(self, robot: Robot, alarm: Callable[[float], None]) -> None:
        self._robot, self._alarm = robot, alarm
        self._timers: dict[str, Timer] = {}
        self._end: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Start listening."""
        self._end = self._robot.events.listen(FaultRaised, self._raised)

    def close(self) -> None:
        """Stop listening."""
        self._end()
        for timer in self._timers.values():
            timer.cancel()
        self._timers.clear()

    def _raised(self, event: FaultRaised) -> None:
        fault = event.fault
        if is_error(fault, event.stamp):
            self._alarm(event.stamp)
        elif fault.name not in self._timers:
            self._timers[fault.name] = self._robot.clock.call_later(LASTING, lambda: self._look_again(fault))

    def _look_again(self, fault: Fault) -> None:
        del self._timers[fault.name]
        now = self._robot.clock.time()
        if any(one.name == fault.name and is_error(one, now) for one in self._robot[Health].faults):
            self._alarm(now)
