"""Stores the learnt values of a robot's odometry in its settings, for the next start."""

from __future__ import annotations

import asyncio
from typing import TYPE_CHECKING

from roboglot.model.components.system.settings import Settings
from roboglot.model.robot import Robot

if TYPE_CHECKING:
    from roboglot.autonomy.slam.slam import Slam

KEY = "autonomy.odometry"
PERIOD, WAY = 30.0, 10.0  # s between two checks; m driven that are worth saving


class OdometryMemory:
    """Memory of learnt odometry until ``close``, for a robot with settings."""

    def __init__(self, robot: Robot, slam: Slam) -> None:
        self._robot, self._slam = robot, slam
        self._kept_at = 0.0  # m driven
        self._timer = robot.clock.call_later(PERIOD, self._look)
        self._writing: asyncio.Task[None] | None = None
        kept = robot[Settings].get(KEY, {})
        if isinstance(kept, dict):
            slam.odometry.restore(kept)

    async def close(self) -> None:
        """Write the newest values."""
        self._timer.cancel()
        if self._writing is not None:
            await asyncio.gather(self._writing, return_exceptions=True)
        if self._slam.way > self._kept_at:
            await self._put()

    def _look(self) -> None:
        self._timer = self._robot.clock.call_later(PERIOD, self._look)
        if self._slam.way - self._kept_at >= WAY and (self._writing is None or self._writing.done()):
            self._writing = asyncio.get_running_loop().create_task(self._put(), name="odometry memory")

    async def _put(self) -> None:
        self._kept_at = self._slam.way
        await self._robot[Settings].keep(KEY, self._slam.odometry.kept)
