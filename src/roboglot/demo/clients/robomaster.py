"""The PyPI package robomasterpy, unmodified, driving the text SDK."""

from __future__ import annotations

import asyncio
import math
from typing import Any

STILL = 5  # equal positions in a row that mean standstill
PATIENCE = 60.0


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
        """Send a move: the SDK answers at once, and the position shows the end."""
        await asyncio.to_thread(lambda: self._commander.chassis_move(x=x, z=z))
        same, last = 0, await self.position()
        async with asyncio.timeout(PATIENCE):
            while same < STILL:
                await asyncio.sleep(0.2)
                now = await self.position()
                same = same + 1 if math.dist(now, last) < 0.02 else 0
                last = now
