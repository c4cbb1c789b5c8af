"""The gripper chapter (manual 3.2.14). Robots number its states differently; nothing is converted here."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class RoboticGripper(Chapter):
    """``client.robotic_gripper``."""

    async def open(self, level: int | None = None) -> None:
        """Open with force 1 to 4 (3.2.14.1)."""
        await self._do("robotic_gripper open", level)

    async def close(self, level: int | None = None) -> None:
        """Close with force 1 to 4 (3.2.14.2)."""
        await self._do("robotic_gripper close", level)

    async def stop(self) -> None:
        """Stop the jaws; in no manual."""
        await self._do("robotic_gripper stop")

    async def get_status(self) -> int:
        """Return the state: 0 closed, 1 between, 2 open in the manual; 2, 0, 1 from real robots (3.2.14.3)."""
        return round(await self._number("robotic_gripper status"))
