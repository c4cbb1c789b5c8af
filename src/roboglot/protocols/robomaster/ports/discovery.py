"""``robot ip A.B.C.D`` for clients that look for the robot, while none holds it in SDK mode (manual 3.2.19)."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.protocols.robomaster.session import Session

PERIOD = 2.0  # s between two broadcasts


async def announce(session: Session, address: str, send: Callable[[bytes], None]) -> None:
    """Broadcast ``address`` until cancelled."""
    message = session.profile.broadcast(address)
    async for _ in session.robot.clock.every(PERIOD):
        if not session.active:
            send(message)
