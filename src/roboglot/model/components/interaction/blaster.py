"""The blaster: shoots gel beads where it points."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component

BEADS_MAX = 8  # per shot


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
        """True if beads of a shot are still to come."""

    @abstractmethod
    def fire(self) -> int:
        """Fire one shot; returns how many beads will leave, one after the other at ``rate``.

        Fewer than ``beads`` if the magazine holds no more. Raises Refused when it is empty, Busy while firing.
        """

    @abstractmethod
    def cease(self) -> None:
        """Keep the beads of the shot under way that have not left yet."""

    @abstractmethod
    def reload(self) -> None:
        """Fill the magazine."""
