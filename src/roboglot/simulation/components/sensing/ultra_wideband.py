"""Ultra-wideband ranging of the connected bracelet: exact in line of sight, longer and noisier through walls."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.ultra_wideband import TagReading, UltraWideband
from roboglot.model.geometry import wrap_angle
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive
from roboglot.simulation.components.system.bluetooth import SimulatedBluetooth
from roboglot.simulation.radio.gadgets import GadgetInWorld, Gadgets

WALL_DETOUR = 0.15  # m that each wall in between seems to add
VAGUE = 3.0  # times the noise without a line of sight
WALLS_MAX = 3  # beyond this many, no signal arrives


class UltraWidebandSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``noise`` of the distance (m), ``angle_noise`` of the azimuth (rad): standard deviations in line of sight."""

    range_max: Positive
    noise: NotNegative
    angle_noise: NotNegative
    rate: Annotated[float, Meta(gt=0, le=50)] = 10.0


class SimulatedUltraWideband(UltraWideband):
    """Ranging that measures when read, at most ``rate`` times a second. Only bracelets have tags."""

    def __init__(
        self,
        section: UltraWidebandSection,
        hull: Hull,
        bluetooth: SimulatedBluetooth,
        gadgets: Gadgets,
        clock: Clock,
        random: np.random.Generator,
    ) -> None:
        self._section, self._hull, self._bluetooth, self._gadgets = section, hull, bluetooth, gadgets
        self._clock, self._random = clock, random
        self._tag: TagReading | None = None
        self._measured = -1.0

    @property
    def tag(self) -> TagReading | None:
        now, gadget = self._clock.time(), self._bluetooth.gadget
        if gadget is None or gadget.gadget.kind != "bracelet" or gadget.floor != self._hull.floor:
            self._tag = None
        elif self._tag is None or now - self._measured >= 1.0 / self._section.rate - 1e-6:
            self._tag, self._measured = self._measure(gadget, now), now
        return self._tag

    def _measure(self, gadget: GadgetInWorld, now: float) -> TagReading | None:
        pose, section = self._hull.pose, self._section
        away = pose.distance_to(gadget.at)
        walls = self._gadgets.radio.walls_between(pose.point, gadget.at, self._hull.floor)
        if away > section.range_max or walls > WALLS_MAX:
            return None
        share = VAGUE if walls else 1.0
        distance_off, angle_off = (self._random.standard_normal(2) * (section.noise, section.angle_noise)).tolist()
        distance = max(0.0, away + WALL_DETOUR * walls + share * distance_off)
        azimuth = wrap_angle(pose.point.bearing_to(gadget.at) - pose.yaw + share * angle_off)
        return TagReading(now, gadget.gadget.address, distance, azimuth, walls == 0)


def _fit(fit: Fitting) -> SimulatedUltraWideband | None:
    bluetooth = fit.find(SimulatedBluetooth)
    if bluetooth is None:
        return None
    section, chance = fit.body[UltraWidebandSection], fit.chance("ultra-wideband")
    return SimulatedUltraWideband(section, fit.hull, bluetooth, fit.world.gadgets, fit.robot.clock, chance)


PART = Part(
    name="ultra_wideband", interface=UltraWideband, section=UltraWidebandSection, fit=_fit, after=("bluetooth",)
)
