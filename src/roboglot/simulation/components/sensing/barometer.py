"""A barometer in the standard atmosphere: pressure by the robot's height, with an offset and noise."""

from __future__ import annotations

import math
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.barometer import Barometer, BarometerReading
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative

SEA_LEVEL = 101_325.0  # Pa, standard atmosphere (ISO 2533)
LAPSE, EXPONENT = 2.25577e-5, 5.25588  # 1/m, and the exponent of the remaining share of temperature


class BarometerSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``rate``: Hz; ``noise`` and the sensor's constant ``offset``: standard deviations, Pa."""

    rate: Annotated[float, Meta(gt=0, le=50)]
    noise: NotNegative
    offset: NotNegative


class SimulatedBarometer(Barometer):
    """Barometer that measures when read, at most ``rate`` times a second."""

    def __init__(
        self, section: BarometerSection, hull: Hull, altitude: float, clock: Clock, random: np.random.Generator
    ) -> None:
        """``altitude``: height of the world's origin above the sea, m."""
        self._section, self._hull, self._altitude, self._clock, self._random = section, hull, altitude, clock, random
        self._offset = float(random.normal(0.0, section.offset))
        self._reading = BarometerReading(-math.inf, SEA_LEVEL)

    @property
    def reading(self) -> BarometerReading:
        now = self._clock.time()
        if now - self._reading.stamp >= 1.0 / self._section.rate - 1e-6:
            air = pressure_at(self._altitude + self._hull.elevation)
            noise = float(self._random.normal(0.0, self._section.noise))
            self._reading = BarometerReading(now, air + self._offset + noise, self._section.noise)
        return self._reading


def pressure_at(altitude: float) -> float:
    """Return the pressure (Pa) of the standard atmosphere at ``altitude`` (m above the sea, up to 11 km)."""
    return float(SEA_LEVEL * (1.0 - LAPSE * altitude) ** EXPONENT)


def _fit(fit: Fitting) -> SimulatedBarometer:
    reference = fit.world.description.georeference
    altitude = reference.altitude if reference is not None else 0.0
    section = fit.body[BarometerSection]
    return SimulatedBarometer(section, fit.hull, altitude, fit.robot.clock, fit.chance("barometer"))


PART = Part(name="barometer", interface=Barometer, section=BarometerSection, fit=_fit)
