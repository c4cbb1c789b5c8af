"""The robot chapter: motion mode and battery (manual 3.2.2)."""

from __future__ import annotations

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.gimbal import FollowMode
from roboglot.model.components.system.link import require_heard
from roboglot.operations import Right
from roboglot.protocols.robomaster.session import Session
from roboglot.protocols.robomaster.table import TABLE


@TABLE.on("robot mode", right=Right.DRIVE)
async def set_mode(session: Session, mode: FollowMode) -> None:
    """Choose who follows whom in yaw (3.2.2.1).

    Without a gimbal the chassis turns by itself in chassis_lead and in free, which is what both ask for.
    """
    session.set_mode(mode)


@TABLE.on("robot mode ?", right=Right.SEE)
async def get_mode(session: Session) -> tuple[str, ...]:
    """The motion mode (3.2.2.2)."""
    return (session.mode,)


@TABLE.on("robot battery ?", right=Right.SEE, needs=(Battery,))
async def battery(session: Session) -> tuple[int, ...]:
    """Charge left in whole percent, 1 to 100 (3.2.2.3)."""
    require_heard(session.robot)
    return (min(100, max(1, round(session.robot[Battery].state.percentage * 100))),)
