"""The sound chapter (manual 3.2.7)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off


class Sound(Chapter):
    """``client.sound``."""

    async def event(self, applause: bool) -> None:
        """Switch Applause on or off (3.2.7.1)."""
        await self._do("sound event", applause=on_off(applause))
