"""Motor temperatures: each motor takes its share of the load and cools into the air around it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.components.motion.motors import Motors
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.components.energy.battery import AMBIENT

UNEVEN = 0.15  # one standard deviation of the shares


MOTORS_MAX = 64


class MotorsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``warming``: steady temperature rise per watt of a motor's share of the load, K/W."""

    names: Annotated[tuple[str, ...], Meta(min_length=1, max_length=MOTORS_MAX)]
    warming: Positive
    inertia: Positive  # s, the time constant


class SimulatedMotors(Motors):
    """Motors with first-order warming and slightly different shares of the load."""

    def __init__(self, section: MotorsSection, hull: Hull, random: np.random.Generator) -> None:
        self._section, self._hull = section, hull
        shares = np.clip(1.0 + random.normal(0.0, UNEVEN, len(section.names)), 0.5, 1.5)
        self._shares = shares / shares.sum()
        self._temperatures = np.full(len(section.names), AMBIENT)
        self._energy = self._seconds = 0.0
        self._hottest = AMBIENT

    @property
    def temperatures(self) -> Mapping[str, float]:
        return dict(zip(self._section.names, self._temperatures.round(2).tolist(), strict=True))

    @property
    def hottest(self) -> float:
        return self._hottest

    def warm(self, celsius: float) -> None:
        """Set the temperature of all motors (Celsius) at once: for tests and faults."""
        self._temperatures[:] = celsius
        self._hottest = round(float(celsius), 2)

    def sense(self, _stamp: float, seconds: float) -> None:
        """Sum up a second's load, then warm up or cool down."""
        self._energy += (self._hull.traction_power + self._hull.effort) * seconds
        self._seconds += seconds
        if self._seconds < 1.0:
            return
        load = self._energy / self._seconds
        goal = AMBIENT + self._section.warming * load * self._shares
        self._temperatures += (goal - self._temperatures) * (1.0 - math.exp(-self._seconds / self._section.inertia))
        self._hottest = round(float(self._temperatures.max()), 2)
        self._energy = self._seconds = 0.0


def _fit(fit: Fitting) -> SimulatedMotors:
    return SimulatedMotors(fit.body[MotorsSection], fit.hull, fit.chance("motors"))


PART = Part(
    name="motors",
    interface=Motors,
    section=MotorsSection,
    fit=_fit,
    after=("health",),
    sense=SimulatedMotors.sense,
    every=5,
    first=5,
)
