"""Keyboard and mouse of the pilot (manual 3.2.20)."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter


class GameMessages(Chapter):
    """``client.game_msg``: the pilot's keyboard and mouse come as GameInput."""

    async def on(self) -> None:
        """Start pushes of GameInput (3.2.20.1)."""
        await self._do("game_msg on")

    async def off(self) -> None:
        """Stop pushes of GameInput (3.2.20.2)."""
        await self._do("game_msg off")
