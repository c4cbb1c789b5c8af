"""Coloured lights in zones, with effects over time."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.values import dataclass

FREQUENCY_MIN, FREQUENCY_MAX = 0.05, 20.0  # Hz


@dataclass(frozen=True, slots=True)
class Colour:
    """Red, green and blue, 0 to 255."""

    red: int = 0
    green: int = 0
    blue: int = 0

    def dimmed(self, share: float) -> Colour:
        """Return this colour at ``share`` (0..1) of its brightness."""
        return Colour(round(self.red * share), round(self.green * share), round(self.blue * share))


DARK = Colour()
WHITE = Colour(255, 255, 255)


class LightEffect(StrEnum):
    """Course of a zone's brightness over one period."""

    OFF = "off"
    SOLID = "solid"
    FLASH = "flash"  # on for the first half, dark for the second
    PULSE = "pulse"  # full brightness at once, then fading
    BREATH = "breath"  # swelling and fading evenly
    SCROLLING = "scrolling"  # lamps of the ring in turn
    FILLING = "filling"  # lamps are added one by one until all are lit
    BOUNCING = "bouncing"  # one lamp runs back and forth
    RAINBOW = "rainbow"  # the hue circles the colour wheel
    CORNERS = "corners"  # four lamps of the ring, a quarter apart, with a circling hue
    BAND = "band"  # a band across the middle of the ring with a circling hue
    TRIAD = "triad"  # three breathing lamps of the ring, a third apart


@dataclass(frozen=True, slots=True)
class ZoneState:
    """The command of a zone; ``frequency`` in Hz, ``since``: robot time at which the effect began, s."""

    colour: Colour
    effect: LightEffect
    frequency: float
    since: float


class Light(Component):
    """Every zone has its own colour and effect; the momentary colour follows from the clock."""

    zones: Mapping[str, int]  # number of lamps per zone

    @abstractmethod
    def shine(
        self,
        zone: str,
        colour: Colour = WHITE,
        effect: LightEffect = LightEffect.SOLID,
        *,
        frequency: float = 2.0,
        lamp: int | None = None,
    ) -> None:
        """Command a zone, or one ``lamp`` (from 0) of a ring: SOLID or OFF only.

        Raises NotFound for an unknown zone or lamp, InvalidGoal for a colour or frequency (Hz) out of range and for an
        effect that the zone cannot show (running lights and figures on a single lamp).
        """

    @abstractmethod
    def state(self, zone: str) -> ZoneState:
        """Return the zone's last command; raises NotFound."""

    @abstractmethod
    def lamps(self, zone: str) -> tuple[Colour, ...]:
        """Return the current colour of each lamp of the zone. Raises NotFound."""
