"""Hibernation of this door: it sends no states and no answers. It ends when any client or event wakes the robot."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

from roboglot.model.components.energy.power import PowerMode
from roboglot.model.events import PowerModeChanged, Rebooted
from roboglot.model.robot import Robot


class Hibernation:
    """While ``on``, only stopHibernation is accepted."""

    def __init__(self, robot: Robot, touch: Callable[[], None]) -> None:
        self._robot, self._touch = robot, touch
        self.on = False
        self._alarm: asyncio.Future[None] | None = None
        self._endings: list[Callable[[], None]] = []

    def begin(self, alarm: asyncio.Future[None] | None) -> None:
        """Hibernate until ``end``, or until the robot is awake again; ``alarm`` wakes it at the set time."""
        self._forget()
        self.on, self._alarm = True, alarm
        listen = self._robot.events.listen
        self._endings += [listen(PowerModeChanged, self._power_changed), listen(Rebooted, lambda _: self.end())]

    def _power_changed(self, event: PowerModeChanged) -> None:
        if event.mode is PowerMode.AWAKE:
            self.end()

    def end(self) -> None:
        """Accept orders and send states again; the set time is forgotten."""
        self.on = False
        self._forget()
        self._touch()

    def _forget(self) -> None:
        while self._endings:
            self._endings.pop()()
        if self._alarm is not None:
            self._alarm.cancel()
            self._alarm = None
