"""The robot chapter (manual 3.2.2)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class RobotChapter(Chapter):
    """``client.robot``: mode and battery."""

    async def mode(self, mode: str) -> None:
        """Set the mode: chassis_lead, gimbal_lead or free (3.2.2.1)."""
        await self._do("robot mode", mode)

    async def get_mode(self) -> str:
        """Return the mode (3.2.2.2)."""
        return (await self._words("robot mode", 1))[0]

    async def get_battery(self) -> int:
        """Return the charge, percent (3.2.2.3)."""
        return round(await self._number("robot battery"))
