"""Commands that answer when their action has ended."""

from __future__ import annotations

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.errors import Expired, RobotError
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.limits import WAIT_MAX


async def ended(context: Context, action: Action) -> None:
    """Wait for an action to succeed; raise its error, or one after WAIT_MAX while it still runs."""
    try:
        status = await context.robot.clock.wait_for(action.done(), WAIT_MAX)
    except TimeoutError:
        raise Expired(f"it has not ended after {WAIT_MAX:g} s and goes on") from None
    if status is not ActionStatus.SUCCEEDED:
        raise RobotError(action.reason or "it was cancelled")
