"""Detection of reflecting strips by a lidar with intensities: rays that hit a strip return bright.

Works on the scans themselves: strips hidden from the lidar, or all without scans, are not detected.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from msgspec import Struct

from roboglot.model.components.sensing.detector import Detector
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.reflectors import Reflectors
from roboglot.model.events import EventStream, ScanTaken
from roboglot.model.feed import Feed, Viewer
from roboglot.model.geometry import Point, Pose
from roboglot.model.perception import ReflectorSeen, Sighting
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.sensing.lidar import LidarSection
from roboglot.simulation.world.description import Reflector, WorldDescription

REACH = 8.0  # m within which enough light returns
SLANT = math.radians(70)  # the steepest angle to a strip
NEAR = 0.12  # m between a ray's end and a strip within which it was hit
QUEUE_MAX = 4


class ReflectorsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A lidar that distinguishes reflecting foil from other things."""


class ReflectorDetector(Detector[ReflectorSeen]):
    """Detector that reports the strips in each scan."""

    def __init__(
        self, hull: Hull, above_belly: float, world: WorldDescription, events: EventStream, rate: float
    ) -> None:
        self.rate = rate
        self._hull, self._above, self._world, self._events = hull, above_belly, world, events
        self._feed: Feed[Sighting[ReflectorSeen]] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._forget: Callable[[], None] | None = None
        self._latest: Sighting[ReflectorSeen] | None = None

    @property
    def latest(self) -> Sighting[ReflectorSeen] | None:
        return self._latest

    def subscribe(self) -> Viewer[Sighting[ReflectorSeen]]:
        return self._feed.subscribe()

    def close(self) -> None:
        """Stop the detector."""
        self._feed.close()

    def _begin(self) -> None:
        self._forget = self._events.listen(ScanTaken, self._look)

    def _end(self) -> None:
        self._latest = None
        if self._forget is not None:
            self._forget()
            self._forget = None

    def _look(self, event: ScanTaken) -> None:
        hull, found = self._hull, []
        height = hull.rise + hull.belly + self._above
        for strip in self._world.floors[hull.floor].reflectors:
            if strip.base <= height <= strip.top:
                seen = _seen(strip, event.scan, hull.pose)
                if seen is not None:
                    found.append(seen)
        self._latest = Sighting(event.stamp, tuple(sorted(found, key=lambda seen: seen.distance)))
        self._feed.push(self._latest)


def _seen(strip: Reflector, scan: LaserScan, pose: Pose) -> ReflectorSeen | None:
    """Return a strip as the mean of the rays that hit it; None: no ray did."""
    at = Pose(*strip.at, math.radians(strip.facing)).relative_to(pose.compose(scan.mount))
    distance, bearing = math.hypot(at.x, at.y), math.atan2(at.y, at.x)
    slant = abs(math.remainder(at.yaw - bearing - math.pi, math.tau))
    if not 0.0 < distance <= REACH or slant > SLANT:
        return None
    half = math.atan2(strip.width / 2 * math.cos(slant), distance)
    off = np.abs(np.remainder(scan.angles - bearing + math.pi, math.tau) - math.pi)
    met = (off <= half) & (np.abs(scan.ranges - distance) <= NEAR)
    if not met.any():
        return None
    ranges, angles = scan.ranges[met].astype(float), scan.angles[met]
    away = float(ranges.mean())
    toward = float(np.arctan2(np.sin(angles).mean(), np.cos(angles).mean()))
    place = scan.mount.compose(Pose(away * math.cos(toward), away * math.sin(toward)))
    return ReflectorSeen(Point(place.x, place.y), away)


class SimulatedReflectors(Reflectors):
    """Reflectors in the scans of the lidar, which is ``above_belly`` m above the belly."""

    def __init__(self, hull: Hull, above_belly: float, world: WorldDescription, robot: Robot) -> None:
        self._detector = ReflectorDetector(hull, above_belly, world, robot.events, robot[Lidar].rate)
        self.detector = self._detector

    def close(self) -> None:
        """Stop the detector."""
        self._detector.close()


def _fit(fit: Fitting) -> SimulatedReflectors:
    above_belly = fit.body[LidarSection].above_belly
    return SimulatedReflectors(fit.hull, above_belly, fit.world.description, fit.robot)


PART = Part(
    name="reflectors",
    interface=Reflectors,
    section=ReflectorsSection,
    needs=("lidar",),
    fit=_fit,
    after=("lidar",),
    detach=SimulatedReflectors.close,
)
