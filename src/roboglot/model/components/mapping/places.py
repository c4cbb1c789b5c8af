"""Named places that people put on the map. An acknowledged change survives a crash."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence

from roboglot.model.components.component import Component
from roboglot.model.maps import PointOfInterest


class Places(Component):
    """Points of interest by id; every change publishes ``PlacesChanged`` once it is on disk."""

    @abstractmethod
    def all(self) -> Sequence[PointOfInterest]:
        """Places in the order they were added."""

    @abstractmethod
    def get(self, id: str) -> PointOfInterest:
        """Return a place. Raises NotFound."""

    @abstractmethod
    async def put(self, *places: PointOfInterest) -> None:
        """Add places, replacing those with the same id; all or none."""

    @abstractmethod
    async def modify(self, id: str, edit: Callable[[PointOfInterest], PointOfInterest]) -> None:
        """Replace a place by ``edit`` of it, after every change under way. Raises NotFound."""

    @abstractmethod
    async def change(self, edit: Callable[[Sequence[PointOfInterest]], Sequence[PointOfInterest]]) -> None:
        """Replace all places by ``edit`` of them, after every change under way, at once and all or none."""

    @abstractmethod
    async def remove(self, id: str) -> None:
        """Delete a place. Raises NotFound."""

    @abstractmethod
    async def clear(self) -> None:
        """Delete all places."""
