"""The armor chapter (manual 3.2.6)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off


class Armor(Chapter):
    """``client.armor``."""

    async def sensitivity(self, value: int) -> None:
        """Set the sensitivity, 1 to 10 (3.2.6.1)."""
        await self._do("armor sensitivity", value)

    async def get_sensitivity(self) -> int:
        """Return the sensitivity (3.2.6.2)."""
        return round(await self._number("armor sensitivity"))

    async def event(self, hit: bool) -> None:
        """Switch ArmorHit on or off (3.2.6.3)."""
        await self._do("armor event", hit=on_off(hit))
