"""Chapter 6.1 and 6.2.1: messages that come, as operations; `roboglot.wire.vda5050` reads their fields."""

from __future__ import annotations

from roboglot.model.components.motion.navigation import Navigation
from roboglot.operations import Right
from roboglot.protocols.vda5050.context import Context
from roboglot.protocols.vda5050.table import TABLE


@TABLE.on("order", right=Right.DRIVE, needs=(Navigation,))
async def take_order(context: Context, *, payload: bytes) -> None:
    """Take an order or an update and drive it."""
    context.take_order(payload)


@TABLE.on("instantActions", right=Right.SEE)
async def take_instant_actions(context: Context, *, payload: bytes) -> None:
    """Execute instant actions, each with its own right."""
    context.take_instant_actions(payload)
