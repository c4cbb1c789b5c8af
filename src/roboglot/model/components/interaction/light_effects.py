"""Light effects over time: the colour of every lamp follows from its command and the clock. Drives no hardware."""

from __future__ import annotations

import colorsys
import math
from collections.abc import Mapping

from roboglot.model.clock import Clock
from roboglot.model.components.interaction.light import (
    DARK,
    FREQUENCY_MAX,
    FREQUENCY_MIN,
    WHITE,
    Colour,
    Light,
    LightEffect,
    ZoneState,
)
from roboglot.model.errors import InvalidGoal, NotFound

FADING = 4.0  # pulses fall to 1/e this many times per period
TAIL = 3  # lamps that trail a running light
STEADY = frozenset({LightEffect.SOLID, LightEffect.OFF})
COLOURFUL = frozenset({LightEffect.RAINBOW, LightEffect.CORNERS, LightEffect.BAND})
FIGURES = {LightEffect.CORNERS: 4, LightEffect.TRIAD: 3}  # number of parts of the ring for each
RUNNING = frozenset({LightEffect.SCROLLING, LightEffect.FILLING, LightEffect.BOUNCING, LightEffect.BAND, *FIGURES})
BAND = 0.5  # of the ring's radius: half the width of a band


class ShownLight(Light):
    """Computes the current colours on request; runs nothing in between. Dark at first."""

    def __init__(self, zones: Mapping[str, int], clock: Clock) -> None:
        self.zones: dict[str, int] = {}
        self._clock = clock
        self._commanded: dict[str, list[ZoneState]] = {}
        self._last: dict[str, ZoneState] = {}
        self.provide(zones)

    def provide(self, zones: Mapping[str, int]) -> None:
        """Add zones (number of lamps by name); known ones keep their state."""
        dark = ZoneState(DARK, LightEffect.OFF, 2.0, self._clock.time())
        for zone, count in zones.items():
            if zone not in self.zones:
                self.zones[zone], self._commanded[zone], self._last[zone] = count, [dark] * count, dark

    def start_afresh(self) -> None:
        """Darken all lamps, as after every start."""
        for zone in self.zones:
            self.shine(zone, DARK, LightEffect.OFF)

    def commanded(self, zone: str, lamp: int) -> ZoneState:
        """Return the last command of this lamp (from 0)."""
        return self._commanded[zone][lamp]

    def shine(
        self,
        zone: str,
        colour: Colour = WHITE,
        effect: LightEffect = LightEffect.SOLID,
        *,
        frequency: float = 2.0,
        lamp: int | None = None,
    ) -> None:
        lamps = self._lamps(zone)
        if not all(0 <= part <= 255 for part in (colour.red, colour.green, colour.blue)):
            raise InvalidGoal(f"a colour's parts are 0 to 255, not {colour.red}, {colour.green}, {colour.blue}")
        if not FREQUENCY_MIN <= frequency <= FREQUENCY_MAX:
            raise InvalidGoal(f"a light's frequency is {FREQUENCY_MIN} to {FREQUENCY_MAX} Hz, not {frequency}")
        if effect in RUNNING and len(lamps) < 2:
            raise InvalidGoal(f"{zone} has a single lamp: running effects need several")
        command = ZoneState(colour, effect, frequency, self._clock.time())
        if lamp is None:
            lamps[:] = [command] * len(lamps)
        elif effect not in (LightEffect.SOLID, LightEffect.OFF):
            raise InvalidGoal(f"a single lamp is solid or off, not {effect}")
        elif not 0 <= lamp < len(lamps):
            raise NotFound(f"{zone} has no lamp {lamp}")
        else:
            lamps[lamp] = command
        self._last[zone] = command

    def state(self, zone: str) -> ZoneState:
        self._lamps(zone)
        return self._last[zone]

    def lamps(self, zone: str) -> tuple[Colour, ...]:
        lamps = self._lamps(zone)
        first = lamps[0]
        if first.effect in STEADY and lamps.count(first) == len(lamps):  # as most are: cameras ask for each picture
            return (first.colour if first.effect is LightEffect.SOLID else DARK,) * len(lamps)
        now = self._clock.time()
        return tuple(
            (_hue(command, now) if command.effect in COLOURFUL else command.colour)
            .dimmed(_brightness(command, now, index, len(lamps)))
            for index, command in enumerate(lamps)
        )  # fmt: skip

    def _lamps(self, zone: str) -> list[ZoneState]:
        try:
            return self._commanded[zone]
        except KeyError:
            raise NotFound(f"there is no light {zone!r}; there are: {', '.join(self.zones)}") from None


def _hue(command: ZoneState, now: float) -> Colour:
    """Return the colour, its hue rotated in step with the elapsed share of the period."""
    colour = command.colour
    hue, saturation, value = colorsys.rgb_to_hsv(colour.red / 255, colour.green / 255, colour.blue / 255)
    turned = (hue + (now - command.since) * command.frequency) % 1.0
    return Colour(*(round(255 * part) for part in colorsys.hsv_to_rgb(turned, saturation, value)))


def _brightness(command: ZoneState, now: float, index: int, count: int) -> float:
    """Return the brightness (0..1) of lamp ``index`` of ``count``."""
    phase = (now - command.since) * command.frequency % 1.0
    match command.effect:
        case LightEffect.OFF:
            return 0.0
        case LightEffect.SOLID | LightEffect.RAINBOW:
            return 1.0
        case LightEffect.FLASH:
            return 1.0 if phase < 0.5 else 0.0
        case LightEffect.PULSE:
            return math.exp(-FADING * phase)
        case LightEffect.BREATH:
            return math.sin(math.pi * phase) ** 2
        case _:
            return _ring_brightness(command.effect, phase, index, count)


def _ring_brightness(effect: LightEffect, phase: float, index: int, count: int) -> float:
    """0..1 of lamp ``index`` of ``count`` for an effect that moves along the ring or draws a figure on it."""
    match effect:
        case LightEffect.CORNERS:
            return float(_on_corner(effect, index, count))
        case LightEffect.TRIAD:
            return math.sin(math.pi * phase) ** 2 if _on_corner(effect, index, count) else 0.0
        case LightEffect.BAND:
            return float(abs(math.cos(math.tau * index / count)) <= BAND + 1e-9)
        case LightEffect.FILLING:
            return 1.0 if index <= phase * count else 0.0
        case LightEffect.BOUNCING:
            return 1.0 if index == round((1.0 - abs(1.0 - 2.0 * phase)) * (count - 1)) else 0.0
    behind = (math.floor(phase * count) - index) % count  # scrolling
    return max(0.0, 1.0 - behind / TAIL)


def _on_corner(effect: LightEffect, index: int, count: int) -> bool:
    """True if the lamp is the one of its ring that lies nearest to a corner of the figure; the first one is on top."""
    corners = FIGURES[effect]
    return any(index == round(count * corner / corners) % count for corner in range(corners))
