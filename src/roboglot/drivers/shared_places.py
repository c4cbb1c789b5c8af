"""A robot's own places and those that are kept here are the same: what changes on one side is changed on the other.

What was changed here without a link is told when it is back. If both sides changed a place, the robot's counts. When
this program starts, the places of both sides are put together.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Collection, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Protocol

from roboglot.drivers.keeper import Keeper
from roboglot.model.components.places import Places
from roboglot.model.errors import RobotError
from roboglot.model.events import PlacesChanged
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
PLACES_MAX = 10_000  # of a robot's that are taken over

Shown = Mapping[str, PointOfInterest]


class FarPlaces(Protocol):
    """The robot's, by id. All methods raise ClientError."""

    async def read(self) -> Shown: ...
    async def write(self, places: Sequence[PointOfInterest], gone: Sequence[PointOfInterest]) -> Collection[str]:
        """Returns the ids that it does not take."""


class SharedPlaces:
    """``sync`` compares both sides with what they agreed on last."""

    def __init__(self, robot: Robot, keeper: Keeper, far: FarPlaces) -> None:
        self._robot, self._keeper, self._far = robot, keeper, far
        self._agreed: Shown = {}
        self._lock = asyncio.Lock()
        self._syncing = False
        robot.events.listen(PlacesChanged, self._changed)

    async def sync(self) -> None:
        """Raises ClientError. What one side does not take stays with the other, and is tried again."""
        async with self._lock:
            far, near = dict([*(await self._far.read()).items()][:PLACES_MAX]), self._near()
            wanted = {**self._agreed, **_changes(near, self._agreed), **_changes(far, self._agreed)}
            there = {id: place for id, place in wanted.items() if place is not None}
            send = [place for id, place in there.items() if far.get(id) != place]
            gone = [place for id, place in far.items() if id not in there]
            refused = await self._far.write(send, gone) if send or gone else ()
            await self._take_over(near, there)
            now = self._near()
            self._agreed = {id: p for id, p in there.items() if now.get(id) == p and id not in refused}

    @asynccontextmanager
    async def replaced(self) -> AsyncIterator[Sequence[PointOfInterest]]:
        """The robot's map is replaced within, and its places by these: nothing that vanishes meanwhile counts."""
        async with self._lock:
            near = self._near()
            yield tuple(near.values())
            self._agreed = near

    def _near(self) -> Shown:
        return {place.id: place for place in self._robot[Places].all()}

    async def _take_over(self, near: Shown, there: Shown) -> None:
        places, self._syncing = self._robot[Places], True
        try:
            if changed := [place for id, place in there.items() if near.get(id) != place]:
                await places.put(*changed)
            for id in near.keys() - there.keys():
                await places.remove(id)
        except RobotError as error:  # too many, or somebody was faster
            log.warning("places of %s: %s", self._keeper.link.address, error)
        finally:
            self._syncing = False

    def _changed(self, _: PlacesChanged) -> None:
        if self._syncing or self._keeper.link.refusal is not None:
            return
        self._keeper.send("telling the robot its places", self.sync())


def _changes(now: Shown, before: Shown) -> dict[str, PointOfInterest | None]:
    """None: removed."""
    changed: dict[str, PointOfInterest | None] = {id: p for id, p in now.items() if before.get(id) != p}
    return changed | dict.fromkeys(before.keys() - now.keys())
