"""The bumper's feelers: slow the robot ahead of obstacles, so that a touch is not a blow.

Rays in two level planes: equal distances in both mean an upright obstacle, a shorter lower one means a slope.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.components.motion.base import SLOW, SimulatedBase
from roboglot.simulation.components.sensing.bumper import BumperSection, SimulatedBumper, zone_of
from roboglot.simulation.world.sight import Sight

HEIGHTS = (0.10, 0.16)  # m above the floor
STEEP = 0.06  # m between the two hits up to which a surface is vertical
RAYS = 120  # per turn
AHEAD = slice(RAYS // 2 - 17, RAYS // 2 + 18)  # those within 51 degrees of the direction of motion
FAN = math.tau / RAYS * np.arange(-17, 18)  # rad from the direction of motion
SIDE, ALONG = np.maximum(1e-9, np.abs(np.sin(FAN))), np.cos(FAN)
DECELERATION = 5.0  # m/s2 of blocked wheels on the floor, with a margin
REACTION = 0.12  # s: a period and a tick
PERIOD = 5  # ticks, as most sensors: fewer ticks have something due


class SoftTouch:
    """Limit of the base's pace. ``speed``: highest speed of a touch, as far as the wheels can brake, m/s."""

    def __init__(self, speed: float, hull: Hull, base: SimulatedBase, bumper: SimulatedBumper, sight: Sight) -> None:
        self._speed, self._hull, self._base, self._bumper, self._sight = speed, hull, base, bumper, sight
        self.duty = Duty()
        base.when_fast.append(self.duty)

    def sense(self, _stamp: float, _seconds: float) -> None:
        """Measure ahead, and limit the base's pace."""
        twist, base = self._base.wanted, self._base
        # A limit holds until the wanted speed is harmless in itself; without a limit, slow driving is not examined.
        slow = twist.speed <= (max(SLOW, self._speed) if math.isinf(base.hindrances.pace) else self._speed)
        if slow:
            base.hindrances.pace = math.inf
            self.duty.end()
            return
        if zone_of(twist.x, twist.y) in self._bumper.masked:
            base.hindrances.pace = math.inf
            return
        now = max(base.velocity.speed, self._speed)
        reach = (now * now - self._speed**2) / (2.0 * DECELERATION) + now * REACTION + 2.0 * self._hull.body.hull.radius
        free = self._free(twist, reach) - now * REACTION
        pace = math.sqrt(self._speed**2 + 2.0 * DECELERATION * max(0.0, free))
        base.hindrances.limit(pace, max(base.velocity.speed, twist.speed))

    def _free(self, twist: Twist, reach: float) -> float:
        """Return the distance from the hull to an upright obstacle towards ``twist`` (base_link), m; inf: none near."""
        hull, radius, way = self._hull, self._hull.body.hull.radius, math.atan2(twist.y, twist.x)
        low, high = HEIGHTS
        near = self._sight.turn(hull, hull.rise + low, RAYS, reach, way)[AHEAD]
        beside = near * SIDE
        ahead = beside < radius
        if not ahead.any():
            return math.inf
        far = self._sight.turn(hull, hull.rise + high, RAYS, reach, way)[AHEAD]
        stands = ahead & (np.abs(far - np.where(ahead, near, 0.0)) < STEEP)
        if not stands.any():
            return math.inf
        rims = np.sqrt(radius * radius - beside[stands] ** 2)
        return float((np.minimum(near, far)[stands] * ALONG[stands] - rims).min())


def _fit(fit: Fitting) -> SoftTouch | None:
    section, bumper = fit.body.get(BumperSection), fit.find(SimulatedBumper)
    if section is None or bumper is None:
        return None
    return SoftTouch(section.touch_speed, fit.hull, fit.get(SimulatedBase), bumper, fit.world.sight)


PART = Part(
    name="soft_touch",
    fit=_fit,
    after=("base", "bumper_stop"),
    sense=SoftTouch.sense,
    every=PERIOD,
    first=PERIOD,
    duty=lambda touch: touch.duty,
)
