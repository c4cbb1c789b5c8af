"""Automatic emergency braking by the lidar, ahead and behind. Without scans it does not brake."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from msgspec import Struct
from numpy.typing import NDArray

from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import EventStream, ObstacleBraked, Rebooted, ScanTaken
from roboglot.model.sensing import LaserScan
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.components.motion.base import SimulatedBase

WHO = "emergency braking"
SLOW = 0.05  # m/s; at creeping speed (onto a dock, to a shelf) it does not intervene
SIDE = 0.02  # m beside the hull that count as ahead
BLOCKED_DECELERATION = 5.0  # m/s2 of blocked wheels on the floor, with a margin


class EmergencyBrakingSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Brakes if the stopping distance plus ``margin`` m exceeds the free distance; ``on``: enabled at the start."""

    margin: Positive
    on: bool = True


class SimulatedEmergencyBraking(EmergencyBraking):
    """Braking that checks every new scan while the robot drives faster than creeping."""

    def __init__(
        self, section: EmergencyBrakingSection, radius: float, base: SimulatedBase, lidar: Lidar, events: EventStream
    ) -> None:
        self._section, self._radius, self._base, self._lidar, self._events = section, radius, base, lidar, events
        self.duty, self._enabled, self._braking = Duty(), section.on, False
        events.listen(ScanTaken, self._wake)
        events.listen(Rebooted, lambda _: self.enable(section.on))
        if section.on:
            base.when_driven.append(self._wake)
        self._seen: LaserScan | None = None
        self._free = (math.inf, math.inf)  # m ahead of the hull and behind it

    @property
    def enabled(self) -> bool:
        return self._enabled

    def enable(self, on: bool) -> None:
        if on is self._enabled:
            return
        self._enabled, notices = on, self._base.when_driven
        if on:
            notices.append(self._wake)
            self._wake()
        else:
            notices.remove(self._wake)
            self._hold(0.0, ahead=False, behind=False)

    @property
    def braking(self) -> bool:
        return self._braking

    def _wake(self, *_: object) -> None:
        """Check in this tick: the speed changes, or there is a new scan."""
        if self._enabled:
            self.duty.begin()

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check the free distances, if driving or braking."""
        speed = self._base.velocity.x
        if not self._enabled or (abs(speed) < SLOW and not self._braking):
            self.duty.end()
            return
        scan = self._lidar.scan
        if scan is not self._seen:
            self._seen = scan
            self._free = _free(scan, self._radius) if scan is not None else (math.inf, math.inf)
        reach = speed * speed / (2.0 * BLOCKED_DECELERATION) + abs(speed) / self._lidar.rate + self._section.margin
        ahead = (speed > SLOW or self._braking) and self._free[0] < reach
        behind = (speed < -SLOW or self._braking) and self._free[1] < reach
        self._hold(stamp, ahead=ahead, behind=behind)
        if not self._braking:
            self.duty.end()  # until the speed changes, or the next scan

    def _hold(self, stamp: float, *, ahead: bool, behind: bool) -> None:
        left = max(0.0, self._free[0] if ahead else self._free[1])
        reason = f"something is {left:.2f} m {'ahead' if ahead else 'behind'}"
        self._base.hindrances.bar(WHO, ahead=ahead, behind=behind, reason=reason)
        if (ahead or behind) and not self._braking:
            self._events.publish(ObstacleBraked(stamp=stamp, distance=self._free[0] if ahead else self._free[1]))
        self._braking = ahead or behind


def _free(scan: LaserScan, radius: float) -> tuple[float, float]:
    """Return the distances between hull and nearest hit in its driving strip, ahead and behind, m."""
    mount, ranges = scan.mount, scan.ranges
    cosines, sines = _ways(len(ranges), scan.angle_min + mount.yaw, scan.angle_increment)
    with np.errstate(invalid="ignore"):  # of rays straight ahead that meet nothing
        y = ranges * sines + mount.y
    strip = np.flatnonzero(np.abs(y) < radius + SIDE)
    along, y = ranges[strip] * cosines[strip] + mount.x, y[strip]
    away = np.abs(along) - np.sqrt(np.maximum(0.0, radius * radius - y * y))
    return float(away[along > 0.0].min(initial=math.inf)), float(away[along < 0.0].min(initial=math.inf))


@lru_cache(maxsize=8)
def _ways(rays: int, first: float, step: float) -> NDArray[np.float64]:
    """Return cosines and sines of the rays' directions (2, n)."""
    angles = first + step * np.arange(rays)
    return np.stack((np.cos(angles), np.sin(angles)))


def _fit(fit: Fitting) -> SimulatedEmergencyBraking:
    section, radius = fit.body[EmergencyBrakingSection], fit.body.hull.radius
    return SimulatedEmergencyBraking(section, radius, fit.get(SimulatedBase), fit.robot[Lidar], fit.robot.events)


PART = Part(
    name="emergency_braking",
    interface=EmergencyBraking,
    section=EmergencyBrakingSection,
    needs=("lidar",),
    fit=_fit,
    after=("base", "lidar"),
    sense=SimulatedEmergencyBraking.sense,
    duty=lambda braking: braking.duty,
)
