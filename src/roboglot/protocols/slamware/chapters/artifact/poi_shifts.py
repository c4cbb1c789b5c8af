"""Shifts of points of interest after loop closures, which correct the map but not the points.

They belong to the corrected map, and are saved and loaded with it: on the map of before a closure the points are right.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from roboglot.model.components.mapping.places import Places
from roboglot.model.components.system.settings import Settings
from roboglot.model.events import LoopClosed, MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.values import dataclass

SAVED = "slamware.poi_shifts"  # the setting that holds those of the map on disk


@dataclass(frozen=True, slots=True)
class Shift:
    """Shift of one place: its current pose, and the corrected one."""

    has: Pose
    should: Pose


class PoiShifts:
    """Follows loop closures; a place that a client has moved since is left alone."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._shifts: dict[str, Shift] = {}
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Start following loop closures; what was not saved is forgotten, as is its map."""
        self._shifts = {}
        listen = self._robot.events.listen
        self._endings = [listen(LoopClosed, self._closed), listen(MapReplaced, lambda _: self._shifts.clear())]

    def close(self) -> None:
        """Stop following loop closures."""
        for end in self._endings:
            end()

    def settings(self, digest: str, floor: str) -> dict[str, object]:
        """Return the setting to store with the map in memory, which is saved as ``floor`` of the file ``digest``."""
        numbers = {id: [*_numbers(shift.has), *_numbers(shift.should)] for id, shift in self._shifts.items()}
        return {SAVED: {"map": digest, "floor": floor, "shifts": numbers}}

    def load(self, digest: str, floor: str) -> None:
        """Take up the shifts saved with this map, which has been loaded."""
        saved = dict(self._robot[Settings].get(SAVED, {}))
        if (saved.get("map"), saved.get("floor")) == (digest, floor):
            self._shifts = {id: Shift(Pose(*n[:3]), Pose(*n[3:])) for id, n in saved["shifts"].items()}

    async def adjust(self) -> None:
        """Move places that were on the map at loop closures to their corrected poses, which are kept if that fails."""
        shifts = self._shifts
        if not shifts:
            return

        def moved(place: PointOfInterest) -> PointOfInterest:
            shift = shifts.get(place.id)
            return replace(place, pose=shift.should) if shift and place.pose == shift.has else place

        await self._robot[Places].change(lambda places: [moved(place) for place in places])
        for id, shift in tuple(shifts.items()):
            if self._shifts.get(id) is shift:  # else another closure came meanwhile
                del self._shifts[id]

    def _closed(self, event: LoopClosed) -> None:
        if not event.moved or Places not in self._robot:
            return
        known, self._shifts = self._shifts, {}
        for place in self._robot[Places].all():
            before = known.get(place.id)
            should = before.should if before and before.has == place.pose else place.pose
            self._shifts[place.id] = Shift(place.pose, _moved(should, event.moved))


def _numbers(pose: Pose) -> tuple[float, float, float]:
    return pose.x, pose.y, pose.yaw


def _moved(pose: Pose, moved: Sequence[tuple[Pose, Pose]]) -> Pose:
    """Return the pose, moved like the nearest place known before and after."""
    before, after = min(moved, key=lambda pair: pair[0].distance_to(pose))
    return after.compose(pose.relative_to(before))
