"""Readiness of a delivering robot: awake, charged, within its hours, and localized."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol

from roboglot.autonomy.delivery.rules import at_work
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.logistics.delivery import Policy
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.storeys import Storeys
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.events import (
    BatteryChanged,
    DeliveryNews,
    DockContactChanged,
    FirmwareChanged,
    ModuleRestarted,
    PoseJumped,
    PowerModeChanged,
)
from roboglot.model.robot import Robot

INSTALLING = (FirmwareState.INSTALLING, FirmwareState.INSTALLED, FirmwareState.REBOOTING)
RECOVERED = 80  # percent at which the robot resumes work after a low battery


class Service(Protocol):
    """Part of the delivery service that readiness needs."""

    @property
    def policy(self) -> Policy: ...

    @property
    def delivers(self) -> bool:
        """True once there has been an order."""

    def wake(self) -> None:
        """Check for orders to begin."""

    def give_up(self) -> None:
        """Cancel all orders: the battery is low."""


class Readiness:
    """Readiness by power, battery, working hours and localization. ``rest_due``: the robot goes to rest when idle."""

    def __init__(self, robot: Robot, service: Service, report: Callable[[DeliveryNews], None]) -> None:
        self._robot, self._service, self._report = robot, service, report
        self.rest_due = False
        self._low = self._off_work = self._lost = False
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Listen to the robot's events."""
        listen = self._robot.events.listen
        self._endings = [
            listen(BatteryChanged, self._battery_changed),
            listen(PoseJumped, lambda _: self._found()),
            listen(DockContactChanged, self._pushed),
            *(listen(kind, lambda _: self._woke()) for kind in (PowerModeChanged, FirmwareChanged, ModuleRestarted)),
        ]

    def close(self) -> None:
        """Stop listening."""
        for end in self._endings:
            end()

    @property
    def works(self) -> bool:
        """True if an order may begin."""
        hours = at_work(self._service.policy, self._robot.clock.epoch())
        return hours and not self._low and not self._lost and self.awake

    @property
    def awake(self) -> bool:
        """False while the robot sleeps or is off, restarts, or is being updated."""
        robot = self._robot
        if Power in robot and robot[Power].mode is not PowerMode.AWAKE:
            return False
        if Firmware not in robot:
            return True
        firmware = robot[Firmware]
        return firmware.restarting is None and firmware.progress.state not in INSTALLING

    @property
    def lost(self) -> bool:
        """True while the robot has lost its pose in the map."""
        return self._lost

    @property
    def parks(self) -> bool:
        """True if the robot rests at its parking place; off work and with a low battery it rests on the dock."""
        return not self._low and not self._off_work

    @property
    def docked(self) -> bool:
        """True while the robot is on a dock."""
        return DockContact in self._robot and self._robot[DockContact].docked

    @property
    def has_home(self) -> bool:
        """True if a dock is known, on this floor or another."""
        if Docking not in self._robot:
            return False
        maps = self._robot[Storeys].maps if Storeys in self._robot else None
        return self._robot[Docking].home is not None or (maps is not None and maps.home() != maps.current)

    @property
    def level(self) -> float:
        """Charge in percent; full for a robot without a battery."""
        return self._robot[Battery].state.percentage * 100 if Battery in self._robot else 100.0

    def look_at_hours(self) -> None:
        """Report the beginning and the end of working hours."""
        off = not at_work(self._service.policy, self._robot.clock.epoch())
        if off != self._off_work:
            self._off_work = off
            self.rest_due |= off
            self._report(DeliveryNews.WORK_ENDED if off else DeliveryNews.WORK_BEGAN)

    def lose(self) -> None:
        """Begin no order until the pose is set or the robot is on its dock."""
        self._lost = True
        self._report(DeliveryNews.PLACE_LOST)

    def _woke(self) -> None:
        if self.awake:
            self._service.wake()

    def _found(self) -> None:
        if self._lost:
            self._lost = False
            self._service.wake()

    def _pushed(self, event: DockContactChanged) -> None:
        """Set the pose of a lost robot that is on its dock."""
        if event.docked and self._lost and (home := self._robot[Docking].home) is not None:
            self._robot[Localization].set_pose(home)

    def _battery_changed(self, _: BatteryChanged) -> None:
        """Send a robot that delivers home with a low battery, switch it off at the end, and resume when charged."""
        if not self._service.delivers:
            return
        state, level, policy = self._robot[Battery].state, self.level, self._service.policy
        if self._low and level >= RECOVERED:
            self._low = False
            self._report(DeliveryNews.WORK_BEGAN)
            self._service.wake()
        elif not self._low and level <= policy.level_home and not state.charging:
            self._low = self.rest_due = True
            self._report(DeliveryNews.BATTERY_LOW)
            self._service.give_up()
        elif level <= policy.level_off and not state.charging and Power in self._robot:
            self._robot[Power].shut_down(source="delivery")
