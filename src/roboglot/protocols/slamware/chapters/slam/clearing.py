"""Clearing of the map in memory, by this door or another: what is drawn stays where it is, in new coordinates."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager

from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import RobotError
from roboglot.model.events import MapReplaced
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)


class Clearing:
    """Has ``move`` take the drawings along to the origin of each map that begins where the robot stands."""

    def __init__(self, robot: Robot, move: Callable[[Pose], Awaitable[None]]) -> None:
        self._robot, self._move = robot, move
        self._waited_for = False  # this door changes the map, and moves the drawings itself
        self._moving: asyncio.Task[None] | None = None
        self._end_watch: Callable[[], None] | None = None

    def start(self) -> None:
        """Begin to follow other doors, unless that has begun."""
        if self._end_watch is None and MapMemory in self._robot:
            self._end_watch = self._robot.events.listen(MapReplaced, self._replaced)

    async def close(self) -> None:
        """End, once the drawings have moved."""
        if self._end_watch is not None:
            self._end_watch()
        await self.finish()

    async def finish(self) -> None:
        """Wait until the drawings are on the map that was cleared last."""
        if self._moving is not None:
            await asyncio.wait([self._moving])

    @contextmanager
    def by_this_door(self) -> Iterator[None]:
        """Leave the drawings to the caller, who clears the map or moves its origin meanwhile."""
        self._waited_for = True
        try:
            yield
        finally:
            self._waited_for = False

    def _replaced(self, event: MapReplaced) -> None:
        origin = event.origin
        if origin is None or self._waited_for or self._robot[Mapping].grid.width:
            return
        before = self._moving

        async def move() -> None:
            if before is not None:
                await asyncio.wait([before])
            try:
                await self._move(origin)
            except RobotError as error:
                log.warning("cannot move the drawings of robot %s to the new map: %s", self._robot.id, error)

        self._moving = asyncio.get_running_loop().create_task(move(), name="drawings move to a new map")
