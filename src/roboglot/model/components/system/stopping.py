"""Stop by a person: the robot stands until a person lets it continue. Knows no client and no page."""

from __future__ import annotations

from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.system.lease import Lease, moves
from roboglot.model.errors import Refused, RobotError
from roboglot.model.robot import Robot


async def stop(robot: Robot, *, reason: str, moving: bool = False) -> None:
    """Cancel all actions, or only those ``moving`` the robot, and hold its orders; return when it stands.

    The next order, the drive home, or a scheduled program would otherwise begin at once. Raises Refused if the hold of
    orders cannot be stored, and then lasts until a restart.
    """
    if Lease in robot:
        robot[Lease].stopped = reason
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
        try:
            await robot[Delivery].execute(False)
        except RobotError as error:
            raise Refused(f"it stands, but its orders are held only until a restart: {error}") from error
