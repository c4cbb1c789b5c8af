"""Memory of where the robot is on the map on disk: its next start continues there, if it was not moved meanwhile."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Sequence

import msgspec

from roboglot.model.clock import Timer
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import settle
from roboglot.model.components.system.settings import Settings
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.values import dataclass

PLACE = "slamware.last_place"  # the setting
KEEP_PERIOD = 10.0  # s that a crash may lose
MOVED = 0.3  # m from the stored place that are worth storing


@dataclass(frozen=True, slots=True)
class LastPlace:
    """Pose (m, rad) on a floor, by its id, of the map on disk with this digest."""

    digest: str
    floor: str
    pose: Pose
    docked: bool


def last_place(robot: Robot) -> LastPlace | None:
    """Return the stored place; None if there is none, or it is unreadable."""
    try:
        return msgspec.convert(robot[Settings].get(PLACE), LastPlace | None)
    except msgspec.ValidationError:
        return None


def is_docked(robot: Robot) -> bool:
    """Return whether the robot stands on a dock; False without contacts."""
    return DockContact in robot and robot[DockContact].docked


class PlaceMemory:
    """Memory of the place; while it is unknown, the last one stays stored.

    ``frame`` returns the digest of the map on disk, the id of the floor in memory, and the m (x, y) by which its origin
    has moved since; None if memory holds another map. ``known``: whether memory still holds what ``frame`` describes,
    and not a map that another door has put there.
    """

    def __init__(self, robot: Robot, frame: Callable[[], tuple[str, str, Sequence[float]] | None]) -> None:
        self._robot, self._frame, self.known = robot, frame, False
        self._timer: Timer | None = None
        self._keeping: asyncio.Task[None] | None = None
        self._stop: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Begin to store the place, unless that has begun."""
        if Settings in self._robot and self._timer is None:
            self._stop = self._robot.events.listen(MapReplaced, self._replaced)
            self._wait()

    async def close(self) -> None:
        """Store the place a last time."""
        if self._timer is None:
            return
        self._stop()
        self._timer.cancel()
        if self._keeping is not None:
            await asyncio.gather(self._keeping, return_exceptions=True)
        await self._keep()

    def keep_soon(self) -> None:
        """Store the place if it has changed, without waiting for it."""
        if self._timer is not None and (self._keeping is None or self._keeping.done()):
            self._keeping = asyncio.get_running_loop().create_task(self._keep(), name="last place")

    def _replaced(self, event: MapReplaced) -> None:
        self.known = self.known and event.origin is not None

    def here(self) -> LastPlace | None:
        """Return the present place; None while it is unknown."""
        localization, frame = self._robot[Localization], self._frame()
        if not self.known or frame is None or localization.lost is not None:
            return None
        digest, floor, (x, y) = frame
        here = localization.pose
        return LastPlace(digest, floor, Pose(here.x + x, here.y + y, here.yaw), is_docked(self._robot))

    def _wait(self) -> None:
        self._timer = self._robot.clock.call_later(KEEP_PERIOD, self._look)

    def _look(self) -> None:
        self.keep_soon()
        self._wait()

    async def _keep(self) -> None:
        await settle(self._robot)
        here, stored = self.here(), last_place(self._robot)
        if here is not None and (stored is None or _differs(here, stored)):
            await self._robot[Settings].keep(PLACE, msgspec.to_builtins(here))


def _differs(here: LastPlace, stored: LastPlace) -> bool:
    same = (here.digest, here.floor, here.docked) == (stored.digest, stored.floor, stored.docked)
    return not same or here.pose.distance_to(stored.pose) > MOVED
