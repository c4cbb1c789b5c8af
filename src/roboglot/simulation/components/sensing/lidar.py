"""A planar lidar: exact distances in its plane, with range limits and noise.

All rays are cast at one instant; a real scanner spreads a turn over its period. On slopes the plane stays level.
"""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import EventStream, ScanTaken
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.sensing import LaserScan
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive
from roboglot.simulation.components.sensing.odometry import SimulatedOdometry
from roboglot.simulation.world.sight import Sight

CLIMBED = 0.01  # m of elevation above its floor from which the robot counts as raised

SAME = 1e-6  # m
RAYS_MAX = 2000
PACKETS = 12  # of a turn


class LidarSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A full turn of ``rays``; ``above_belly`` is the height of its plane above the belly.

    ``dropouts``: share of rays that measure nothing (NaN); every ``sector_every`` s on average a packet of a twelfth of
    a turn is lost (0: never); ``jitter``: standard deviation (s) of the stamp, by which odometry is looked up.
    ``gloss``: whether glass lets rays pass and mirrors reflect them; otherwise both act like any wall.
    ``dark``: share of black furniture, which is measured only within ``dark_reach`` m (NaN beyond).
    """

    rays: Annotated[int, Meta(ge=4, le=RAYS_MAX)]
    rate: Annotated[float, Meta(gt=0, le=50)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    above_belly: NotNegative
    dropouts: Annotated[float, Meta(ge=0, lt=1)] = 0.0
    sector_every: NotNegative = 0.0
    jitter: Annotated[float, Meta(ge=0, le=0.1)] = 0.0
    dark: Annotated[float, Meta(ge=0, le=1)] = 0.0
    dark_reach: Positive = 2.5
    gloss: bool = True


class SimulatedLidar(Lidar):
    """Lidar in the middle of the torso, which sees through its own hull."""

    def __init__(
        self,
        section: LidarSection,
        hull: Hull,
        sight: Sight,
        odometry: SimulatedOdometry | None,
        events: EventStream,
        random: np.random.Generator,
        tick: float,
    ) -> None:
        self._section, self._hull, self._sight = section, hull, sight
        self._odometry, self._events, self._random = odometry, events, random
        self.period = max(1, round(1.0 / (section.rate * tick)))  # ticks
        self.rate = 1.0 / (self.period * tick)
        self._increment = math.tau / section.rays
        self._scan: LaserScan | None = None
        self.silent = False  # whether it has stopped sending

    @property
    def scan(self) -> LaserScan | None:
        return self._scan

    def sense(self, stamp: float, _seconds: float) -> None:
        """Take a scan at the end of a turn."""
        if self.silent:
            self._scan = None
            return
        section, hull = self._section, self._hull
        rise = hull.rise
        rise = rise if abs(rise) > CLIMBED else 0.0
        height = rise + hull.belly + section.above_belly
        exact = self._sight.turn(hull, height, section.rays, section.range_max)
        if section.gloss:
            exact = self._sight.glossy(hull, height, section.rays, section.range_max, exact)
        noise = self._random.standard_normal(section.rays, dtype=np.float32)
        ranges = self._sight.blur(exact, noise, section.noise, section.range_min, section.range_max)
        if section.dark:
            black = self._sight.dark(hull, height, section.rays, section.range_max, section.dark)
            ranges[(black > section.dark_reach) & (black <= exact + SAME) & np.isfinite(black)] = np.nan
        if section.dropouts or section.sector_every:
            self._drop(ranges)
        ranges.setflags(write=False)
        late = abs(self._random.normal(0.0, section.jitter)) if section.jitter else 0.0
        self._scan = LaserScan(
            max(0.0, stamp - late),
            ranges,
            -math.pi,
            self._increment,
            section.range_min,
            section.range_max,
            mount=ORIGIN,
        )
        pose = self._odometry.pose if self._odometry else ORIGIN
        if late and self._odometry:  # the driver uses slightly older odometry
            twist = self._odometry.reading.twist
            pose = pose.compose(Pose(-late * twist.x, -late * twist.y, -late * twist.yaw))
        self._events.publish(ScanTaken(stamp=stamp, scan=self._scan, odometry=pose))

    def _drop(self, ranges: NDArray[np.float32]) -> None:
        """Drop single rays at random (dark, glossy, grazing), and now and then a packet."""
        section, random = self._section, self._random
        if section.dropouts:
            ranges[random.random(len(ranges)) < section.dropouts] = np.nan
        if section.sector_every and random.random() < 1.0 / (self.rate * section.sector_every):
            first = int(random.integers(len(ranges)))
            ranges[(first + np.arange(len(ranges) // PACKETS)) % len(ranges)] = np.nan


def _fit(fit: Fitting) -> SimulatedLidar:
    section, odometry, chance = fit.body[LidarSection], fit.find(SimulatedOdometry), fit.chance("lidar")
    return SimulatedLidar(section, fit.hull, fit.world.sight, odometry, fit.robot.events, chance, fit.tick)


PART = Part(
    name="lidar",
    interface=Lidar,
    section=LidarSection,
    fit=_fit,
    after=("odometry",),
    sense=SimulatedLidar.sense,
    every=lambda lidar: lidar.period,
    first=0,
)
