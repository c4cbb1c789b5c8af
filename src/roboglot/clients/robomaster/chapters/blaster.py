"""The blaster chapter (manual 3.2.5)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class Blaster(Chapter):
    """``client.blaster``."""

    async def bead(self, num: int) -> None:
        """Set the beads per shot (3.2.5.1)."""
        await self._do("blaster bead", num)

    async def fire(self) -> None:
        """Fire one shot (3.2.5.2)."""
        await self._do("blaster fire")

    async def get_bead(self) -> int:
        """Return the beads per shot (3.2.5.3)."""
        return round(await self._number("blaster bead"))
