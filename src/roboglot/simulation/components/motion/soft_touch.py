"""The bumper's feelers: what stands close ahead of the way makes the robot slow, so that a touch is no blow.

A fan of level rays at two heights: what both meet at the same distance stands, what the lower one meets first slopes.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.sensing.bumper import BumperSection, SimulatedBumper, zone_of

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays

HEIGHTS = (0.10, 0.16)  # m above the floor
STEEP = 0.06  # m between the two hits up to which it stands
FAN = np.radians((-50.0, -30.0, -18.0, -9.0, 0.0, 9.0, 18.0, 30.0, 50.0))  # from the way
DECELERATION = 5.0  # m/s2 of blocked wheels on the floor, with reserve
REACTION = 0.1  # s
PERIOD = 4  # ticks
SLOW = 0.3  # m/s; it does not begin to feel at less


class SoftTouch:
    """``speed`` (m/s): the fastest that it lets the hull touch something, as far as the wheels can brake."""

    def __init__(self, speed: float, hull: Hull, base: SimulatedBase, bumper: SimulatedBumper, rays: Rays) -> None:
        self._speed, self._hull, self._base, self._bumper, self._rays = speed, hull, base, bumper, rays

    def sense(self, _stamp: float, _seconds: float) -> None:
        """Feel ahead, and bound the base's pace."""
        twist, base = self._base.wanted, self._base
        slow = twist.speed <= (max(SLOW, self._speed) if math.isinf(base.pace) else self._speed)
        if slow or zone_of(twist.x, twist.y) in self._bumper.masked:
            base.pace = math.inf
            return
        now = max(base.velocity.speed, self._speed)
        reach = (now * now - self._speed**2) / (2.0 * DECELERATION) + now * REACTION + 2.0 * self._hull.body.hull.radius
        free = self._free(twist, reach) - now * REACTION
        base.pace = math.sqrt(self._speed**2 + 2.0 * DECELERATION * max(0.0, free))

    def _free(self, twist: Twist, reach: float) -> float:
        """Metres between the hull and what stands where ``twist`` (base_link) leads; inf if it is far."""
        hull, radius = self._hull, self._hull.body.hull.radius
        angles = math.atan2(twist.y, twist.x) + FAN
        fan = np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(FAN))))
        turned = hull.to_world(fan)
        low = self._rays.cast(self._eye(HEIGHTS[0]), turned, reach, hull)
        if not np.isfinite(low).any():  # casting is dear
            return math.inf
        high = self._rays.cast(self._eye(HEIGHTS[1]), turned, reach, hull)
        with np.errstate(invalid="ignore"):
            beside = low * np.abs(np.sin(FAN))
            stands = np.isfinite(low) & (np.abs(high - low) < STEEP) & (beside < radius)
        if not stands.any():
            return math.inf
        rims = np.sqrt(radius * radius - beside[stands] ** 2)
        return float((np.minimum(low, high)[stands] * np.cos(FAN)[stands] - rims).min())

    def _eye(self, height: float) -> tuple[float, float, float]:
        """Above base_link's middle, in the world."""
        x, y, z = (self._hull.position + self._hull.to_world(np.array([[0.0, 0.0, height]]))[0]).tolist()
        return x, y, z


def _fit(fit: Fitting) -> SoftTouch | None:
    section, bumper = fit.body.get(BumperSection), fit.find(SimulatedBumper)
    if section is None or bumper is None:
        return None
    return SoftTouch(section.touch_speed, fit.hull, fit.get(SimulatedBase), bumper, fit.world.rays)


PART = Part(name="soft_touch", fit=_fit, after=("base", "bumper_stop"), sense=SoftTouch.sense, every=PERIOD)
