"""An electronic skin: patches of the hull that turn dark or light, still or over time. Knows no vendor's numbers."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from enum import StrEnum

from roboglot.model.components.component import Component
from roboglot.values import dataclass

CYCLE_MIN, CYCLE_MAX = 0.1, 60.0  # s


class Shade(StrEnum):
    """Shade that a patch shows."""

    DARK = "dark"
    LIGHT = "light"


class Patch(StrEnum):
    """Parts of the skin: three of the trunk, one on each leg."""

    FRONT = "front"
    MIDDLE = "middle"
    REAR = "rear"
    RIGHT_FRONT_LEG = "right front leg"
    LEFT_FRONT_LEG = "left front leg"
    RIGHT_REAR_LEG = "right rear leg"
    LEFT_REAR_LEG = "left rear leg"


class SkinPattern(StrEnum):
    """Pattern of the patches over time."""

    DARK = "dark"
    LIGHT = "light"
    REARWARD = "rearward"  # patches turn light from front to rear, then dark in the same order, and so on
    FORWARD = "forward"  # the same from the rear to the front
    FLASH = "flash"  # all at once, alternating light and dark
    RANDOM = "random"  # at random, redrawn each time
    FOOTFALLS = "footfalls"  # standing legs show one shade, everything else the other


@dataclass(frozen=True, slots=True)
class SkinState:
    """The commanded pattern; ``cycle``: s for a change of the whole skin; ``since``: its start, robot time.

    ``standing``: the shade of a leg that stands, for FOOTFALLS.
    """

    enabled: bool
    pattern: SkinPattern
    cycle: float
    standing: Shade
    since: float


class ElectronicSkin(Component):
    """Switched off, the whole skin is dark; switched on again, the pattern starts again."""

    @property
    @abstractmethod
    def state(self) -> SkinState:
        """Last command."""

    @property
    @abstractmethod
    def shades(self) -> Mapping[Patch, Shade]:
        """Current shade of each patch; patches of legs whose state is unknown are left out."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch it on or off."""

    @abstractmethod
    def show(self, pattern: SkinPattern, *, cycle: float = 1.0, standing: Shade = Shade.LIGHT) -> None:
        """Command a pattern.

        Raises InvalidGoal for a cycle beyond CYCLE_MIN and CYCLE_MAX, Refused while the skin is switched off and for
        FOOTFALLS of a body without feet.
        """
