"""Stop by a person: the robot stands until a person lets it continue. Knows no client and no page."""

from __future__ import annotations

from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.system.lease import moves
from roboglot.model.robot import Robot


async def stop(robot: Robot, *, reason: str, moving: bool = False) -> None:
    """Cancel all actions, or only those ``moving`` the robot, and hold its orders; return when it stands.

    The next order, or the drive home, would otherwise begin at once. A database that cannot store the hold raises its
    error after that; the hold then lasts until a restart.
    """
    held = Delivery in robot and robot[Delivery].halt()
    if moving:
        doomed = [action for action in robot.actions.running() if moves(action)]
        for action in doomed:
            action.cancel(reason)
        for action in doomed:
            await action.done()
    else:
        await robot.actions.cancel(reason=reason)
    if held:
        await robot[Delivery].execute(False)
