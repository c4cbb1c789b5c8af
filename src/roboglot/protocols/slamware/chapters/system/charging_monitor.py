"""Detection of a robot that fails to charge on its dock."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.clock import Timer
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.events import BatteryChanged, DockContactChanged
from roboglot.model.robot import Robot

PATIENCE = 10.0  # s on the dock until current must flow
CHARGED = 0.9  # charge above which no current is expected


class ChargingWatch:
    """Calls ``failed`` once per failure."""

    def __init__(self, robot: Robot, failed: Callable[[], None]) -> None:
        self._robot, self._failed = robot, failed
        self._timer: Timer | None = None
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Start watching, if the robot has a dock contact and a battery."""
        if Battery in self._robot and DockContact in self._robot:
            listen = self._robot.events.listen
            self._endings = [listen(kind, lambda _: self._look()) for kind in (DockContactChanged, BatteryChanged)]

    def close(self) -> None:
        """Stop watching."""
        for end in self._endings:
            end()
        self._forget()

    def _starves(self) -> bool:
        state = self._robot[Battery].state
        return self._robot[DockContact].docked and not state.charging and state.percentage < CHARGED

    def _look(self) -> None:
        if not self._starves():
            self._forget()
        elif self._timer is None:
            self._timer = self._robot.clock.call_later(PATIENCE, self._check)

    def _check(self) -> None:
        """Report once: the timer stays until the robot charges or leaves."""
        if self._starves():
            self._failed()

    def _forget(self) -> None:
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
