"""Contents of the map in use beside its grid, replaced atomically: a crash leaves the old or the new."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field

from roboglot.model.components.component import Component
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.maps import PointOfInterest
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Drawings:
    """Points of interest and annotations of one map."""

    places: Sequence[PointOfInterest]
    annotations: Annotations


@dataclass(frozen=True, slots=True)
class Replacement:
    """The new drawings, and settings and files that go with them (None: no such file)."""

    drawings: Drawings
    settings: Mapping[str, object] = field(default_factory=dict)
    files: Mapping[str, bytes | None] = field(default_factory=dict)


class MapMemory(Component):
    """Over ``Places``, ``MapAnnotations``, ``Settings`` and ``FileStore``, which show the new state afterwards."""

    @abstractmethod
    async def replace(self, edit: Callable[[Drawings], Replacement]) -> None:
        """Replace the current drawings by ``edit`` of them, atomically.

        Returns once all is on disk. Raises InvalidGoal beyond the components' limits, and then nothing changes. Ids of
        annotations are never reused.
        """
