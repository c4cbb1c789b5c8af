"""The floors that were loaded from the map file. Knows no files, and no robot."""

from __future__ import annotations

from collections.abc import Container, Sequence
from dataclasses import replace

from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.mapping.map_memory import Drawings
from roboglot.model.geometry import ORIGIN, Pose
from roboglot.protocols.slamware.chapters.artifact.drawing import seen_from
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, FloorName


class LoadedFloors:
    """Floors of the file with ``digest``; ``shown``: the one in memory as seen from its present origin."""

    def __init__(self) -> None:
        self.digest = ""
        self.shown: tuple[FloorMap, ...] = ()
        self._filed: tuple[FloorMap, ...] = ()
        self._origin = ORIGIN  # of the map in memory, in the frame of its floor in the file

    def hold(self, floors: Sequence[FloorMap], digest: str) -> None:
        """Hold the floors of a file that was loaded."""
        self._filed, self.digest = tuple(floors), digest
        self.restore()

    def restore(self) -> None:
        """Show all floors as in the file: another one is in memory, or none."""
        self.shown, self._origin = self._filed, ORIGIN

    def move(self, current: FloorName, origin: Pose, files: Container[str]) -> None:
        """Show the floor in memory as seen from its new ``origin`` (in its present frame).

        Its places and docks move; its areas stay in the file's frame, which entering a floor needs. No effect unless
        this file is one of ``files``, the digests of those that memory's map comes from.
        """
        if self.digest not in files:
            return
        self._origin = self._origin.compose(origin)
        self.shown = tuple(_moved(f, self._origin) if f.name == current else f for f in self._filed)

    def find(self, building: str, floor: str) -> FloorMap | None:
        """Return a floor as in the file; None if there is none of this name."""
        return next((f for f in self._filed if (f.name.building, f.name.floor) == (building, floor)), None)


def _moved(floor: FloorMap, origin: Pose) -> FloorMap:
    """Return the floor with its places and docks as seen from another origin."""
    seen = seen_from(origin, Drawings(floor.places, Annotations(docks=floor.annotations.docks)))
    notes = replace(floor.annotations, docks=seen.annotations.docks)
    return replace(floor, places=tuple(seen.places), annotations=notes)
