"""The PyPI package robomasterpy, unmodified, driving the text SDK."""

from __future__ import annotations

import asyncio
import math
from typing import Any

PATIENCE = 300.0  # s per move: the machine may be busy
NEAR, NEAR_YAW = 0.1, 5.0  # m, degrees from the end of a move


class RoboMasterClient:
    """robomasterpy's Commander at ``address``, called from threads because it blocks."""

    def __init__(self, address: str) -> None:
        from robomasterpy import Commander

        self._commander: Any = Commander(address)

    async def close(self) -> None:
        """Hang up."""
        await asyncio.to_thread(self._commander.close)

    async def position(self) -> tuple[float, float, float]:
        """x ahead and y right in m, z clockwise in degrees, since power-on."""
        position = await asyncio.to_thread(self._commander.get_chassis_position)
        return position.x, position.y, position.z

    async def turn(self, yaw: float) -> None:
        """Turn left by ``yaw`` rad."""
        await self._move(z=-math.degrees(yaw))

    async def ahead(self, distance: float) -> None:
        """Drive ahead by ``distance`` m."""
        await self._move(x=distance)

    async def _move(self, x: float = 0, z: float = 0) -> None:
        """Send a move: the SDK answers at once; position and status show the end."""
        began = await self.position()
        await asyncio.to_thread(lambda: self._commander.chassis_move(x=x, z=z))
        async with asyncio.timeout(PATIENCE):
            while not await self._has_moved(began, abs(x), z):  # noqa: ASYNC110 - only polling
                await asyncio.sleep(0.2)

    async def _has_moved(self, began: tuple[float, float, float], way: float, turn: float) -> bool:
        """Return whether the robot stands ``way`` m and ``turn`` degrees from where it ``began``."""
        if not (await asyncio.to_thread(self._commander.get_chassis_status)).static:
            return False
        now = await self.position()
        left = math.remainder(now[2] - began[2] - turn, 360.0)
        return abs(math.dist(now[:2], began[:2]) - way) < NEAR and abs(left) < NEAR_YAW
