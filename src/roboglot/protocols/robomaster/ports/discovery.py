"""Broadcast of ``robot ip A.B.C.D`` to searching clients while no client holds SDK mode (manual 3.2.19)."""

from __future__ import annotations

from collections.abc import Callable
from ipaddress import IPv4Address

from roboglot.protocols.robomaster.context import Context
from roboglot.transport.own_addresses import own_addresses

PERIOD = 2.0  # s between two broadcasts


async def announce(context: Context, address: str, send: Callable[[bytes, str], None]) -> None:
    """Broadcast ``address`` until cancelled: ``send`` gets the datagram and the address to send it from.

    A robot at 0.0.0.0 has each address of this machine, and tells each network the one that is reached from there.
    """
    everywhere = IPv4Address(address).is_unspecified
    async for _ in context.robot.clock.every(PERIOD):
        if not context.active:
            for own in own_addresses() if everywhere else [address]:
                send(context.profile.broadcast(own), own)
