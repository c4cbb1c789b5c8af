"""Time-of-flight sensors on the torso: 8 x 8 rays each, cast when read."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight, ZoneDistances
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Orientation, Point, Vector3
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Angle, NotNegative, Offset, Positive
from roboglot.simulation.world.rays import Rays

ZONES = 8
SIGMAS = 10.0  # of noise: what lies farther off is never seen
Floats = NDArray[np.float64]


SENSORS_MAX = 16


class Eye(Struct, frozen=True, forbid_unknown_fields=True):
    """Mount of a sensor on the torso: ahead, left, above the belly (m), turned by yaw and pitch (nose down), rad."""

    name: Annotated[str, Meta(min_length=1, max_length=30)]
    forward: Offset
    above_belly: Offset
    left: Offset = 0.0
    yaw: Angle = 0.0
    pitch: Angle = 0.0


class TimeOfFlightSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Grids of 8 x 8 zones over a square ``field_of_view`` (rad); ``rate`` in Hz, ranges and ``noise`` in m."""

    rate: Annotated[float, Meta(gt=0, le=60)]
    field_of_view: Annotated[float, Meta(gt=0, lt=2)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    sensors: Annotated[tuple[Eye, ...], Meta(min_length=1, max_length=SENSORS_MAX)]


class _Held(NamedTuple):
    """Sensors at one posture of the torso: eyes (n, 3; m) and rays in base_link, both also in the readings' form."""

    posture: tuple[Orientation, Point, float]
    eyes: Floats
    ahead: Floats
    rays: list[NDArray[np.float32]]
    places: list[Vector3]


class SimulatedTimeOfFlight(TimeOfFlight):
    """Sensors that turn with the torso."""

    def __init__(
        self, section: TimeOfFlightSection, hull: Hull, rays: Rays, clock: Clock, random: np.random.Generator
    ) -> None:
        self._section, self._hull, self._rays, self._clock, self._random = section, hull, rays, clock, random
        self.names = tuple(eye.name for eye in section.sensors)
        self.rate = section.rate
        bundle = _bundle(section.field_of_view)
        self._bundles = np.concatenate([bundle @ rotation((0.0, eye.pitch), eye.yaw).T for eye in section.sensors])
        self._whole = np.ones(len(self._bundles))
        self._mounts = np.array([(eye.forward, eye.left, eye.above_belly) for eye in section.sensors])
        self._readings: list[ZoneDistances] = []
        self._measured_at = -math.inf
        self._held: _Held | None = None

    @property
    def readings(self) -> list[ZoneDistances]:
        now = self._clock.time()
        if now - self._measured_at >= 1.0 / self.rate - 1e-6:
            self._measured_at = now
            self._measure(now)
        return self._readings

    def reading(self, name: str) -> ZoneDistances:
        if name not in self.names:
            raise NotFound(f"there is no time-of-flight sensor {name!r}")
        return self.readings[self.names.index(name)]

    def _measure(self, stamp: float) -> None:
        """Take readings of all sensors at once."""
        section, hull = self._section, self._hull
        posture = hull.attitude, hull.shift, hull.belly
        if self._held is None or self._held.posture != posture:
            self._held = self._hold(posture)
        held = self._held
        reach = section.range_max + SIGMAS * section.noise
        distances = self._rays.look(held.eyes, held.ahead, reach, hull)
        noise, low, high = self._random.standard_normal(len(distances)), section.range_min, section.range_max
        readings = self._rays.reading(distances, self._whole, noise, (section.noise, 0.0), (low, high, -math.inf))
        grids = readings.reshape(-1, ZONES, ZONES)
        grids.setflags(write=False)
        views = zip(grids, held.rays, held.places, strict=True)
        self._readings = [ZoneDistances(stamp, grid, low, high, rays, eye) for grid, rays, eye in views]

    def _hold(self, posture: tuple[Orientation, Point, float]) -> _Held:
        """Compute the sensors' positions and rays, once per posture of the torso."""
        hull, (_, shift, belly) = self._hull, posture
        eyes, ahead = hull.held(self._mounts) + np.array((shift.x, shift.y, belly)), hull.held(self._bundles)
        rays = ahead.astype(np.float32)
        rays.setflags(write=False)
        each = np.split(rays, len(eyes))
        return _Held(posture, eyes, ahead, each, [Vector3(*eye) for eye in eyes.tolist()])


def _bundle(field_of_view: float) -> Floats:
    """Return unit vectors (n x 3) through the zones' middles: x ahead, y left, z up; from the top left, by rows."""
    edge = math.tan(field_of_view / 2) * (1.0 - 1.0 / ZONES)
    steps = np.linspace(edge, -edge, ZONES)
    y, z = np.meshgrid(steps, steps)
    rays = np.stack((np.ones_like(y), y, z), axis=-1).reshape(-1, 3)
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _fit(fit: Fitting) -> SimulatedTimeOfFlight:
    section, chance = fit.body[TimeOfFlightSection], fit.chance("time of flight")
    return SimulatedTimeOfFlight(section, fit.hull, fit.world.rays, fit.robot.clock, chance)


PART = Part(name="time_of_flight", interface=TimeOfFlight, section=TimeOfFlightSection, fit=_fit)
