"""Distance sensors at the hull's edge: the nearest of a fan of exact rays, with noise and range limits.

The fan lies in the robot's own plane; a real cone also has a height.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.components.sensing.range_sensor import RangeReading, RangeSensors
from roboglot.model.errors import NotFound
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Offset, Positive
from roboglot.simulation.bodies.schedule import Duty

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays

RAYS = 7  # per fan


class RangeSensorsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Sensors at the hull's edge, each looking outwards to its ``facings`` (rad); ``noise``: share of the distance."""

    facings: dict[str, Annotated[float, Meta(ge=-3.2, le=3.2)]]
    above_belly: Offset
    rate: Annotated[float, Meta(gt=0, le=50)]
    range_min: NotNegative
    range_max: Positive
    fov: Annotated[float, Meta(ge=0, le=1.5)]
    noise: Annotated[float, Meta(ge=0, le=0.5)]


class SimulatedRangeSensors(RangeSensors):
    """Range sensors; cast no rays while switched off."""

    def __init__(
        self, section: RangeSensorsSection, hull: Hull, rays: Rays, random: np.random.Generator, tick: float
    ) -> None:
        self.names = tuple(section.facings)
        self._section, self._hull, self._rays, self._random = section, hull, rays, random
        self._period = max(1, round(1.0 / (section.rate * tick)))
        self._until_next = 1
        self.duty = Duty()
        self._readings: dict[str, RangeReading] = {}
        spread = np.linspace(-section.fov / 2, section.fov / 2, RAYS if section.fov else 1)
        self._fans = {name: _fan(facing + spread) for name, facing in section.facings.items()}

    @property
    def measuring(self) -> bool:
        return self.duty.on

    def measure(self, on: bool) -> None:
        self._until_next = 1
        if on:
            self.duty.begin()
        else:
            self.duty.end()
            self._readings.clear()

    def reading(self, name: str) -> RangeReading | None:
        if name not in self._fans:
            raise NotFound(f"there is no range sensor {name!r}; there are: {', '.join(self.names)}")
        return None if name in self.silent else self._readings.get(name)

    def sense(self, stamp: float, _seconds: float) -> None:
        """Measure with all sensors when due."""
        if not self.duty.on:
            return
        self._until_next -= 1
        if self._until_next:
            return
        self._until_next = self._period
        for name in self.names:
            self._readings[name] = self._measure(name, stamp)

    def _measure(self, name: str, stamp: float) -> RangeReading:
        section, hull = self._section, self._hull
        facing, edge = section.facings[name], hull.body.hull.radius
        at = (edge * math.cos(facing), edge * math.sin(facing), hull.belly + section.above_belly)
        seen = hull.to_world(np.vstack((at, self._fans[name])))
        x, y, z = (hull.position + seen[0]).tolist()
        found = self._rays.cast(np.array(((x, y, z),)), seen[1:], section.range_max, hull)
        distance = float(found.min()) * (1.0 + section.noise * float(self._random.standard_normal()))
        distance = max(section.range_min, distance) if distance <= section.range_max else math.inf
        mount = Pose(at[0], at[1], facing)
        return RangeReading(stamp, distance, section.range_min, section.range_max, section.fov, mount, at[2])


def _fan(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return level unit vectors (n x 3) in these directions (rad)."""
    return np.column_stack((np.cos(angles), np.sin(angles), np.zeros(len(angles))))


def _fit(fit: Fitting) -> SimulatedRangeSensors:
    section, chance = fit.body[RangeSensorsSection], fit.chance("range sensors")
    return SimulatedRangeSensors(section, fit.hull, fit.world.rays, chance, fit.tick)


PART = Part(
    name="range_sensors",
    interface=RangeSensors,
    section=RangeSensorsSection,
    fit=_fit,
    sense=SimulatedRangeSensors.sense,
    duty=lambda sensors: sensors.duty,
)
