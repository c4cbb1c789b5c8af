"""Georeference of a map: fitted to satellite fixes taken while driving, used to find the robot in it.

A tangent plane, good for some kilometres. Knows no receiver and no map format.
"""

from __future__ import annotations

import math
from collections.abc import Iterable

from roboglot.model.components.mapping.localization import Region
from roboglot.model.components.sensing.gps import Gps, GpsFix, GpsReading
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot
from roboglot.values import dataclass

EQUATOR = 6_378_137.0  # m, WGS-84
FLATTENING = 1 / 298.257223563
SIGMAS = 3.0  # standard deviations that a search allows for
BASELINE = 6.0  # accuracies that fixes must be apart before north can be computed
SLACK = 2.0  # m added to a search: the robot's own size, a slightly bent map


@dataclass(frozen=True, slots=True)
class GlobeAnchor:
    """``point`` of the map (m) lies at these degrees (WGS-84), within ``accuracy`` (m, one standard deviation).

    ``north`` is the direction of north in the map (rad, counter-clockwise from x); None while it is not known.
    """

    point: Point
    latitude: float
    longitude: float
    accuracy: float
    north: float | None = None

    def around(self, fix: GpsReading) -> Region:
        """Return the square of the map in which a robot with this fix can be, errors included."""
        east, north = offset(self.latitude, self.longitude, fix.latitude, fix.longitude)
        reach = self._reach(fix)
        x, y = self.point.x, self.point.y
        if self.north is None:
            reach += math.hypot(east, north)  # the distance counts in every direction
        else:
            c, s = math.cos(self.north), math.sin(self.north)
            x, y = x + c * north + s * east, y + s * north - c * east
        return Region(x - reach, y - reach, x + reach, y + reach)

    def allows(self, fix: GpsReading, place: Point) -> bool:
        """Return True if a receiver with this fix can be at ``place`` of the map."""
        region = self.around(fix)
        inside = region.min_x <= place.x <= region.max_x and region.min_y <= place.y <= region.max_y
        away = math.hypot(*offset(self.latitude, self.longitude, fix.latitude, fix.longitude))
        return inside and abs(self.point.distance_to(place) - away) <= math.sqrt(2.0) * self._reach(fix)

    def _reach(self, fix: GpsReading) -> float:
        return SIGMAS * math.hypot(self.accuracy, fix.accuracy) + SLACK


@dataclass(frozen=True, slots=True)
class Sky:
    """A satellite fix in an anchored map."""

    anchor: GlobeAnchor
    fix: GpsReading

    @property
    def region(self) -> Region:
        """Region of the map in which the robot can be."""
        return self.anchor.around(self.fix)

    def allows(self, place: Point) -> bool:
        """Return whether the robot can be at ``place``."""
        return self.anchor.allows(self.fix, place)


def sky_over(anchor: GlobeAnchor | None, robot: Robot) -> Sky | None:
    """Return the latest fix in its map; None without a fix, or without a georeference."""
    if anchor is None or Gps not in robot or robot[Gps].reading.fix is GpsFix.NONE:
        return None
    return Sky(anchor, robot[Gps].reading)


def offset(latitude: float, longitude: float, to_latitude: float, to_longitude: float) -> tuple[float, float]:
    """Return metres (east, north) from the first place to the second, both in degrees."""
    east, north = metres_a_degree(latitude)
    return math.remainder(to_longitude - longitude, 360.0) * east, (to_latitude - latitude) * north


def metres_a_degree(latitude: float) -> tuple[float, float]:
    """Return what a degree of longitude and one of latitude measure there, m."""
    phi = math.radians(latitude)
    e2 = FLATTENING * (2.0 - FLATTENING)
    bulge = 1.0 - e2 * math.sin(phi) ** 2
    across, meridian = EQUATOR / math.sqrt(bulge), EQUATOR * (1.0 - e2) / bulge**1.5
    return math.radians(across * math.cos(phi)), math.radians(meridian)


def anchor(samples: Iterable[tuple[Point, GpsReading]]) -> GlobeAnchor | None:
    """Fit an anchor to places in the map and the fixes taken there; None without a fix.

    North is known once the fixes lie BASELINE accuracies apart: the turn that fits the two sets of places best.
    """
    good = [(point, fix) for point, fix in samples if fix.fix is not GpsFix.NONE]
    if not good:
        return None
    count = len(good)
    latitude = sum(fix.latitude for _, fix in good) / count
    longitude = good[0][1].longitude + sum(_east_of(good[0][1], fix) for _, fix in good) / count
    middle = Point(sum(point.x for point, _ in good) / count, sum(point.y for point, _ in good) / count)
    accuracy = max(fix.accuracy for _, fix in good)  # errors of neighbouring fixes are correlated
    along = across = spread = 0.0
    for point, fix in good:
        east, north = offset(latitude, longitude, fix.latitude, fix.longitude)
        x, y = point.x - middle.x, point.y - middle.y
        along += x * north - y * east
        across += y * north + x * east
        spread = max(spread, math.hypot(x, y))
    north_is = math.atan2(across, along) if 2.0 * spread >= BASELINE * accuracy else None
    return GlobeAnchor(middle, latitude, longitude, accuracy, north_is)


def _east_of(first: GpsReading, fix: GpsReading) -> float:
    """Return degrees east of ``first``, also across the date line."""
    return math.remainder(fix.longitude - first.longitude, 360.0)
