"""The robotic arm chapter (manual 3.2.13). cm in the manual, mm from robots; nothing is converted here."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class ArmPosition:
    """Forward and up: the manual's cm, robots' mm."""

    x: float
    y: float


class RoboticArm(Chapter):
    """``client.robotic_arm``."""

    async def move(self, x: float, y: float, *, wait: bool = False) -> None:
        """Move by an offset (3.2.13.1)."""
        await self._do("robotic_arm move", x=x, y=y, wait=wait or None)

    async def moveto(self, x: float, y: float, *, wait: bool = False) -> None:
        """Move to a position (3.2.13.2)."""
        await self._do("robotic_arm moveto", x=x, y=y, wait=wait or None)

    async def recenter(self, *, wait: bool = False) -> None:
        """Return to the position at power-on (3.2.13.3)."""
        await self._do("robotic_arm recenter", wait=wait or None)

    async def stop(self) -> None:
        """Stop and hold the position (3.2.13.4)."""
        await self._do("robotic_arm stop")

    async def get_position(self) -> ArmPosition:
        """Return the position of the end point (3.2.13.5)."""
        return ArmPosition(*await self._numbers("robotic_arm position", 2))
