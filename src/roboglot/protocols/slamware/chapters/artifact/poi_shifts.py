"""Shifts of points of interest after loop closures: the map was straightened, the points stayed where they were."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from roboglot.model.components.mapping.places import Places
from roboglot.model.events import LoopClosed, MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot


@dataclass(frozen=True, slots=True)
class Shift:
    """Shift of one place: the pose that it has, and the one that it should have."""

    has: Pose
    should: Pose


class PoiShifts:
    """Watches loops being closed; a place that a client moves meanwhile is left alone."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._shifts: dict[str, Shift] = {}
        self._endings: list[Callable[[], None]] = []

    def start(self) -> None:
        """Watch from now on."""
        listen = self._robot.events.listen
        self._endings = [listen(LoopClosed, self._closed), listen(MapReplaced, lambda _: self._shifts.clear())]

    def close(self) -> None:
        """Watch no more."""
        for end in self._endings:
            end()

    async def adjust(self) -> None:
        """Put all places that were on the map when loops were closed to where they are on the straightened map."""
        shifts, self._shifts = self._shifts, {}
        places = [place for place in self._robot[Places].all() if place.id in shifts]
        stale = [place for place in places if place.pose == shifts[place.id].has]
        await self._robot[Places].put(*(replace(place, pose=shifts[place.id].should) for place in stale))

    def _closed(self, event: LoopClosed) -> None:
        if not event.moved or Places not in self._robot:
            return
        known, self._shifts = self._shifts, {}
        for place in self._robot[Places].all():
            before = known.get(place.id)
            should = before.should if before and before.has == place.pose else place.pose
            self._shifts[place.id] = Shift(place.pose, _moved(should, event.moved))


def _moved(pose: Pose, moved: Sequence[tuple[Pose, Pose]]) -> Pose:
    """Return the pose moved as the nearest of the places that are known before and after."""
    before, after = min(moved, key=lambda pair: pair[0].distance_to(pose))
    return after.compose(pose.relative_to(before))
