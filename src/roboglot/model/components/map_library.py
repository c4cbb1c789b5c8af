"""The maps that the robot keeps by name."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field

from roboglot.model.components.component import Component
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid


@dataclass(frozen=True, slots=True)
class Label:
    """A named point on a stored map, in its map frame (m)."""

    name: str
    point: Point
    kind: str = ""


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A saved grid with the labels that people set on it; ``saved_at`` is seconds since 1970."""

    name: str
    grid: OccupancyGrid
    saved_at: float
    labels: tuple[Label, ...] = field(default=())


class MapLibrary(Component):
    """Saved maps by name. What was acknowledged survives a crash."""

    @abstractmethod
    async def names(self) -> Sequence[str]:
        """Oldest first."""

    @abstractmethod
    async def get(self, name: str) -> StoredMap:
        """The one, or NotFound."""

    @abstractmethod
    async def put(self, stored: StoredMap) -> None:
        """Save, or replace the one of the same name."""

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Forget it, or NotFound."""
