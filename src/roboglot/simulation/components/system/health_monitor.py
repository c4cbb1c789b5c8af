"""Checks the parts five times a second and sets their faults in Health. Knows no vendor's codes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.health import MOTOR_ALARM, FaultLevel, Health
from roboglot.model.components.system.network import Network, NetworkMode
from roboglot.model.events import BrakeChanged, EmergencyStopChanged
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.values import dataclass

PERIOD = 10  # ticks
EMPTY = 0.05  # charge below which the battery is an error
HOT = 60.0  # Celsius
DOUBT, CERTAIN = 0.2, 0.5  # quality of localization below which the robot is lost, and from which it is not
STUCK_AFTER = 5.0  # s of pushing against an immovable obstacle
SCANLESS_AFTER = 1.0  # s


@dataclass(frozen=True, slots=True)
class _Watch:
    """A possible fault of a part: name, level, message, and ``wrong``: its test.

    ``lasting``: test whether a present fault lasts, if different.
    """

    interface: type[Component]
    name: str
    part: str
    level: FaultLevel
    message: str
    wrong: Callable[[Any], bool]
    lasting: Callable[[Any], bool] | None = None


WARNING, ERROR, FATAL = FaultLevel.WARNING, FaultLevel.ERROR, FaultLevel.FATAL


def _netless(card: Network) -> bool:
    """True for a station that is not in a network."""
    return not card.connected and card.state.mode is NetworkMode.STATION


def _is_in_doubt(localization: Localization, quality: float) -> bool:
    """True if localization is enabled and started, but its quality is below ``quality`` (0..1)."""
    known = localization.lost is None and localization.quality >= quality
    return localization.enabled and localization.started and not known


WATCHES = (
    _Watch(Base, MOTOR_ALARM, "base", ERROR, "a wheel's motor does not turn", lambda base: base.wheels.dead),
    _Watch(Base, "fallen", "base", FATAL, "the robot fell down", lambda base: base.locks.held_by("fallen")),
    _Watch(Battery, "battery low", "battery", WARNING, "low battery", lambda it: it.charge < it.low),
    _Watch(Battery, "battery empty", "battery", ERROR, "battery all but empty", lambda it: it.charge < EMPTY),
    _Watch(Battery, "battery hot", "battery", ERROR, "the battery is hot", lambda it: it.temperature > HOT),
    _Watch(Motors, "motor hot", "motors", WARNING, "a motor is too hot", lambda it: it.hottest > it.hot),
    _Watch(EmergencyStop, "emergency stop", "emergency stop", ERROR, "emergency stop", lambda it: it.engaged),
    _Watch(EmergencyStop, "brake released", "base", ERROR, "motor brake released", lambda it: it.brake_released),
    _Watch(Cliff, "cliff", "cliff", WARNING, "there is a drop ahead", lambda it: it.detected),
    _Watch(DepthCamera, "depth camera lost", "depth camera", ERROR, "the depth camera sends nothing",
           lambda it: not it.connected),
    _Watch(RangeSensors, "range sensor lost", "range sensors", ERROR, "a distance sensor sends nothing",
           lambda it: it.silent),
    _Watch(Jack, "jack alarm", "jack", ERROR, "the jack does not move", lambda it: it.alarm),
    _Watch(Network, "network lost", "network", WARNING, "no Wi-Fi", _netless),
    _Watch(Network, "network slow", "network", WARNING, "answers come late", lambda it: it.delay > 0.0),
    _Watch(Disk, "disk full", "disk", ERROR, "the disk is full", lambda it: it.free <= 0),
    _Watch(Localization, "not localized", "localization", WARNING, "the robot does not know where it is",
           lambda it: _is_in_doubt(it, DOUBT), lambda it: _is_in_doubt(it, CERTAIN)),
)  # fmt: skip


class HealthWatch:
    """Watch over the parts that the robot has at the first check, including later added ones (localization)."""

    def __init__(self, robot: Robot, health: Health, hull: Hull) -> None:
        self._robot, self._health, self._hull = robot, health, hull
        self._watches: list[tuple[_Watch, Component]] | None = None
        for changed in (EmergencyStopChanged, BrakeChanged):  # these are noticed elsewhere at the same instant
            robot.events.listen(changed, lambda _: self._look())
        self._pressed_since: dict[str, float] = {}
        self._scanned = 0.0

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check all parts."""
        if self._watches is None:
            robot, self._scanned = self._robot, stamp
            self._watches = [(watch, robot[watch.interface]) for watch in WATCHES if watch.interface in robot]
        self._look()
        if Lidar in self._robot:
            self._health.set("lidar lost", self._scanless(stamp), "lidar", FATAL, "the lidar sends nothing")
        if Bumper in self._robot:
            self._health.set("bumper stuck", self._bumper_stuck(stamp), "bumper", ERROR, "a bumper stays pressed")

    def _look(self) -> None:
        health = self._health
        for watch, part in self._watches or ():
            before = health.has(watch.name)
            wrong = watch.lasting if before and watch.lasting else watch.wrong
            if bool(wrong(part)) != before:
                health.set(watch.name, not before, watch.part, watch.level, watch.message)

    def _scanless(self, now: float) -> bool:
        """True if scans stopped by themselves: a robot that sleeps or is off has switched its lidar off."""
        if self._robot[Lidar].scan is not None or self._rests():
            self._scanned = now
        return now - self._scanned >= SCANLESS_AFTER

    def _rests(self) -> bool:
        return Power in self._robot and self._robot[Power].mode in (PowerMode.ASLEEP, PowerMode.OFF)

    def _bumper_stuck(self, now: float) -> bool:
        """Return whether a zone has been pressed for long without a contact at the hull."""
        pressed = () if self._hull.touches else self._robot[Bumper].pressed
        if not pressed and not self._pressed_since:
            return False
        self._pressed_since = {zone: self._pressed_since.get(zone, now) for zone in pressed}
        return any(now - since >= STUCK_AFTER for since in self._pressed_since.values())


def _fit(fit: Fitting) -> HealthWatch:
    health = fit.robot.add(Health, Health(fit.robot.clock, fit.robot.events))
    return HealthWatch(fit.robot, health, fit.hull)


PART = Part(
    name="health",
    fit=_fit,
    after=(
        "battery",
        "bumper",
        "cliff",
        "emergency_braking",
        "fall_guard",
        "jack",
        "lidar",
        "network",
        "range_sensors",
    ),
    sense=HealthWatch.sense,
    every=PERIOD,
    first=PERIOD,
)
