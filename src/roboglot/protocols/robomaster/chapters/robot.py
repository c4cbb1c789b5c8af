"""The robot chapter: motion mode and battery (manual 3.2.2)."""

from __future__ import annotations

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.gimbal import FollowMode
from roboglot.model.components.system.link import require_heard
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.table import TABLE


@TABLE.on("robot mode", right=Right.DRIVE)
def set_mode(context: Context, mode: FollowMode) -> None:
    """Set the coupling of gimbal and chassis in yaw (3.2.2.1).

    Without a gimbal the chassis turns by itself in chassis_lead and in free.
    """
    context.set_mode(mode)


@TABLE.on("robot mode ?", right=Right.SEE)
def get_mode(context: Context) -> tuple[str, ...]:
    """Return the motion mode (3.2.2.2)."""
    return (context.mode,)


@TABLE.on("robot battery ?", right=Right.SEE, needs=(Battery,))
def battery(context: Context) -> tuple[int, ...]:
    """Return the charge in whole percent, 1 to 100 (3.2.2.3)."""
    require_heard(context.robot)
    return (min(100, max(1, round(context.robot[Battery].state.percentage * 100))),)
