"""The named places that people put on the map. What was acknowledged survives a crash."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence

from roboglot.model.components.component import Component
from roboglot.model.maps import PointOfInterest


class Places(Component):
    """Points of interest by id; every change publishes ``PlacesChanged`` when it is safe on disk."""

    @abstractmethod
    def all(self) -> Sequence[PointOfInterest]:
        """Places in the order they were added."""

    @abstractmethod
    def get(self, id: str) -> PointOfInterest:
        """The one, or NotFound."""

    @abstractmethod
    async def put(self, *places: PointOfInterest) -> None:
        """Add, or replace those with the same id; all or none."""

    @abstractmethod
    async def remove(self, id: str) -> None:
        """Forget it, or NotFound."""

    @abstractmethod
    async def clear(self) -> None:
        """Forget all."""
