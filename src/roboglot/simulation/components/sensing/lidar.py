"""A planar lidar: exact distances in its plane, with range limits and noise.

All rays are cast at one instant; a real scanner spreads a turn over its period. On slopes the plane stays level.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.kernels.arrays import FloatArray
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import EventStream, ScanTaken
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.model.sensing import LaserScan
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive
from roboglot.simulation.bodies.tables import RobotTables
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
        self._section, self._hull, self.sight = section, hull, sight
        self._odometry, self._events, self._random = odometry, events, random
        self.period = max(1, round(1.0 / (section.rate * tick)))  # ticks
        self.rate = 1.0 / (self.period * tick)
        self._increment = math.tau / section.rays
        self._scan: LaserScan | None = None
        self.silent = False  # whether it has stopped sending
        self.turns: _Turns | None = None  # of all robots
        self.taken: NDArray[np.float32] | None = None  # ranges measured in this tick, with those of the others

    @property
    def scan(self) -> LaserScan | None:
        return self._scan

    def sense(self, stamp: float, _seconds: float) -> None:
        """Take a scan at the end of a turn."""
        if self.turns is not None:
            self.turns.expect(self)
        ranges, self.taken, section = self.taken, None, self._section
        if self.silent:
            self._scan = None
            return
        if ranges is None:
            ranges = self._measure()
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

    @property
    def height(self) -> float:
        """Height of its plane above the floor, m."""
        rise = self._hull.rise
        return (rise if abs(rise) > CLIMBED else 0.0) + self._hull.belly + self._section.above_belly

    def view(self) -> _View | None:
        """Return its view, if its ranges can be measured with those of others."""
        section, floor = self._section, self._hull.floor
        if self.silent or section.dark or not self.sight.many(floor, gloss=section.gloss):
            return None
        limits = section.range_max, section.noise, section.range_min, section.range_max
        return _View(floor, round(self.height, 3), section.rays, limits)

    def prepare(self, eye: FloatArray, readings: NDArray[np.float32]) -> None:
        """Write where it looks from (x, y, yaw) to ``eye``, and the noise of a turn to ``readings``."""
        hull = self._hull
        eye[0], eye[1], eye[2] = hull.x, hull.y, hull.turned
        self._random.standard_normal(dtype=np.float32, out=readings)

    def _measure(self) -> NDArray[np.float32]:
        """Return the ranges of a turn, with noise."""
        section, hull, height = self._section, self._hull, self.height
        exact = self.sight.turn(hull, height, section.rays, section.range_max)
        if section.gloss:
            exact = self.sight.glossy(hull, height, section.rays, section.range_max, exact)
        noise = self._random.standard_normal(section.rays, dtype=np.float32)
        ranges = self.sight.blur(exact, noise, section.noise, section.range_min, section.range_max)
        if section.dark:
            black = self.sight.dark(hull, height, section.rays, section.range_max, section.dark)
            ranges[(black > section.dark_reach) & (black <= exact + SAME) & np.isfinite(black)] = np.nan
        return ranges

    def _drop(self, ranges: NDArray[np.float32]) -> None:
        """Drop single rays at random (dark, glossy, grazing), and now and then a packet."""
        section, random = self._section, self._random
        if section.dropouts:
            ranges[random.random(len(ranges)) < section.dropouts] = np.nan
        if section.sector_every and random.random() < 1.0 / (self.rate * section.sector_every):
            first = int(random.integers(len(ranges)))
            ranges[(first + np.arange(len(ranges) // PACKETS)) % len(ranges)] = np.nan


class _View(NamedTuple):
    """Properties that turns have in common which one call of the kernel can measure."""

    floor: int
    height: float  # m
    rays: int
    limits: tuple[float, ...]


class _Turns:
    """Turns of all robots' lidars that end in the same tick, measured one after the other in one kernel."""

    def __init__(self, sight: Sight) -> None:
        self._sight = sight
        self._tick = 0
        self._due: dict[int, list[SimulatedLidar]] = {}  # by tick

    def expect(self, lidar: SimulatedLidar) -> None:
        """Measure for ``lidar`` when its next turn ends."""
        self._due.setdefault(self._tick + lidar.period, []).append(lidar)

    def measure(self, tick: int) -> None:
        """Measure all turns that end in this tick."""
        self._tick = tick
        views: dict[_View, list[SimulatedLidar]] = {}
        for lidar in self._due.pop(self._tick, ()):
            if (view := lidar.view()) is not None:
                views.setdefault(view, []).append(lidar)
        for view, lidars in views.items():
            eyes, readings = np.empty((len(lidars), 3)), np.empty((len(lidars), view.rays), np.float32)
            for lidar, eye, row in zip(lidars, eyes, readings, strict=True):
                lidar.prepare(eye, row)
            self._sight.turns(view.floor, view.height, eyes, readings, view.limits)
            for lidar, row in zip(lidars, readings, strict=True):
                lidar.taken = row.copy()  # it may be kept for long


def _measure_all(_: RobotTables, lidars: Sequence[SimulatedLidar]) -> Callable[[int], None]:
    turns = _Turns(lidars[0].sight)
    for lidar in lidars:
        lidar.turns, lidar.taken = turns, None
    return turns.measure


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
    ahead=_measure_all,
    every=lambda lidar: lidar.period,
    first=0,
)
