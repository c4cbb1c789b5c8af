"""The blaster: shoots gel beads where it points."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal

BEADS_MAX = 8  # per shot


def check_beads(beads: int) -> None:
    """Raise InvalidGoal unless a shot can have this number of beads."""
    if not 1 <= beads <= BEADS_MAX:
        raise InvalidGoal(f"a shot has 1 to {BEADS_MAX} beads, not {beads}")


class Blaster(Component):
    """Publishes ``BeadFired`` for every bead that leaves the muzzle."""

    rate: float  # beads per second within a shot

    @property
    @abstractmethod
    def beads(self) -> int:
        """Number of beads that one shot fires."""

    @abstractmethod
    def set_beads(self, beads: int) -> None:
        """Have a shot fire 1 to 8 beads; raises InvalidGoal otherwise."""

    @property
    @abstractmethod
    def ammo(self) -> int:
        """Beads left in the magazine."""

    @property
    @abstractmethod
    def firing(self) -> bool:
        """True while beads of a shot have yet to leave."""

    @abstractmethod
    def fire(self) -> int:
        """Fire one shot; return the number of beads, which leave one by one at ``rate``.

        It is lower than ``beads`` if the magazine runs out. Raises Refused when it is empty, Busy while firing.
        """

    @abstractmethod
    def cease(self) -> None:
        """Stop the shot under way; its remaining beads stay in the magazine."""

    @abstractmethod
    def reload(self) -> None:
        """Fill the magazine."""
