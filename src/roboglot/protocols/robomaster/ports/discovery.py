"""Broadcast of ``robot ip A.B.C.D`` to searching clients while no client holds SDK mode (manual 3.2.19)."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.protocols.robomaster.context import Context

PERIOD = 2.0  # s between two broadcasts


async def announce(context: Context, address: str, send: Callable[[bytes], None]) -> None:
    """Broadcast ``address`` until cancelled."""
    message = context.profile.broadcast(address)
    async for _ in context.robot.clock.every(PERIOD):
        if not context.active:
            send(message)
