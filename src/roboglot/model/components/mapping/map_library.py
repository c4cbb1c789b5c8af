"""Stored maps of the robot, by name."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import field

from roboglot.model.components.component import Component
from roboglot.model.geodesy import GlobeAnchor
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Label:
    """A named point on a stored map, in its map frame (m)."""

    name: str
    point: Point
    kind: str = ""


@dataclass(frozen=True, slots=True)
class StoredMap:
    """A saved grid with the labels that people set on it; ``saved_at`` is seconds since 1970.

    ``outdoor``: it was made under the open sky, and is used there; ``anchor`` is where on the globe it lies, as far as
    the robot had satellites. ``number``: what people call it by besides its name; 0 if they gave none. ``dock``: where
    base_link stands when docked, in its map frame; None if the robot knew no dock.
    """

    name: str
    grid: OccupancyGrid
    saved_at: float
    labels: tuple[Label, ...] = field(default=())
    outdoor: bool = False
    number: int = 0
    anchor: GlobeAnchor | None = None
    dock: Pose | None = None


class MapLibrary(Component):
    """Stored maps by name. An acknowledged change survives a crash.

    A number means one map: stored with a number other than 0, a map takes it from any other.
    """

    @abstractmethod
    async def names(self, *, outdoor: bool | None = None, number: int | None = None) -> Sequence[str]:
        """Return names, oldest first; filtered by outdoor or indoor, and by number, if given."""

    @abstractmethod
    async def get(self, name: str) -> StoredMap:
        """Return a map. Raises NotFound."""

    @abstractmethod
    async def put(self, stored: StoredMap) -> None:
        """Store a map, replacing one of the same name."""

    @abstractmethod
    async def modify(self, name: str, edit: Callable[[StoredMap], StoredMap]) -> None:
        """Replace a map by ``edit`` of it, after every change under way; nothing is written if that is the same map.

        ``edit`` runs in any thread. Raises NotFound, and what ``edit`` raises.
        """

    @abstractmethod
    async def remove(self, name: str) -> None:
        """Delete a map. Raises NotFound."""
