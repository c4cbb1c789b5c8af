"""Satellite navigation: a fix under the open sky after a search, none indoors; errors wander slowly."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.gps import Gps, GpsFix, GpsReading
from roboglot.model.geodesy import metres_a_degree
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.world.description import Georeference, WorldDescription

WANDER = 60.0  # s over which an error stays roughly constant
SATELLITES = 14  # in view under the open sky
FEW = 4  # satellites received through a roof and windows
COARSE = 3.0  # times worse while the fix is young


class GpsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``noise``: one standard deviation of the position under the open sky, m; ``search``: s until the first fix."""

    rate: Annotated[float, Meta(gt=0, le=20)]
    noise: NotNegative
    search: NotNegative


class SimulatedGps(Gps):
    """Receiver that measures when read, at most ``rate`` times a second."""

    def __init__(
        self, section: GpsSection, hull: Hull, world: WorldDescription, clock: Clock, random: np.random.Generator
    ) -> None:
        self._section, self._hull, self._clock, self._random = section, hull, clock, random
        self._floors, self._reference = world.floors, world.georeference
        self._error = random.standard_normal(3)
        self._reading = GpsReading(clock.time())
        self._measured = -math.inf
        self._sky_since: float | None = None
        self.jammed = False  # whether no satellite is received

    @property
    def reading(self) -> GpsReading:
        now = self._clock.time()
        if now - self._measured >= 1.0 / self._section.rate - 1e-6:
            self._reading = self._measure(now)
            self._measured = now
        return self._reading

    def sense(self, stamp: float, _seconds: float) -> None:
        """Note since when the sky is open."""
        if self._reference is None or self.jammed or not self._floors[self._hull.floor].outdoors:
            self._sky_since = None
        elif self._sky_since is None:
            self._sky_since = stamp

    def _measure(self, now: float) -> GpsReading:
        old, section = self._reading, self._section
        if self._reference is None:
            return GpsReading(now)
        seen = int(self._random.integers(-2, 3))
        if self._sky_since is None or now - self._sky_since < section.search:
            satellites = max(0, FEW // 2 + seen) if self._sky_since is None else FEW
            satellites = 0 if self.jammed else satellites
            return GpsReading(now, GpsFix.NONE, satellites, old.latitude, old.longitude, old.altitude, 0.0)
        keep = math.exp(-min(10.0, (now - self._measured) / WANDER)) if self._measured > -math.inf else 0.0
        self._error = keep * self._error + math.sqrt(1.0 - keep * keep) * self._random.standard_normal(3)
        young = now - self._sky_since < 2 * section.search
        sigma = section.noise * (COARSE if young else 1.0)
        dx, dy, dz = (self._error * (sigma, sigma, 2.0 * sigma)).tolist()
        at, reference = self._hull.pose, self._reference
        latitude, longitude = globe(reference, at.x + dx, at.y + dy)
        altitude = reference.altitude + self._hull.elevation + dz
        fix = GpsFix.PLANE if young else GpsFix.SPACE
        return GpsReading(now, fix, SATELLITES + seen, latitude, longitude, altitude, sigma)


def globe(reference: Georeference, x: float, y: float) -> tuple[float, float]:
    """Return latitude and longitude (degrees) of a place (world, m) by a tangent plane, valid for some km."""
    north_is = math.radians(reference.north)
    north = x * math.cos(north_is) + y * math.sin(north_is)
    east = x * math.sin(north_is) - y * math.cos(north_is)
    a_degree_east, a_degree_north = metres_a_degree(reference.latitude)
    return reference.latitude + north / a_degree_north, reference.longitude + east / a_degree_east


def _fit(fit: Fitting) -> SimulatedGps:
    return SimulatedGps(fit.body[GpsSection], fit.hull, fit.world.description, fit.robot.clock, fit.chance("gps"))


PART = Part(
    name="gps",
    interface=Gps,
    section=GpsSection,
    fit=_fit,
    after=("health",),
    sense=SimulatedGps.sense,
    every=5,
    first=5,
)
