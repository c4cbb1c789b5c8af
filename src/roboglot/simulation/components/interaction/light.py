"""Coloured lights in zones; each lamp's colour follows from effect and clock alone."""

from __future__ import annotations

from msgspec import Struct

from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.light_effects import ShownLight
from roboglot.model.events import Rebooted
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Count


class LightSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Number of lamps of each zone."""

    zones: dict[str, Count]


def _fit(fit: Fitting) -> ShownLight:
    light = ShownLight(fit.body[LightSection].zones, fit.robot.clock)
    fit.robot.events.listen(Rebooted, lambda _: light.start_afresh())
    return light


PART = Part(name="light", interface=Light, section=LightSection, fit=_fit)
