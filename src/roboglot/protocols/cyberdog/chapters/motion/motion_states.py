"""Postures in which motions begin, and the current state of the body and its actions."""

from __future__ import annotations

from collections.abc import Set

from roboglot.model.actions import Action
from roboglot.model.client_context import client
from roboglot.model.components.motion.legs import Posture
from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus
from roboglot.model.components.motion.motions import MOTIONS
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.motion.motion_table import FIGURES, MAY_LAST, USERS
from roboglot.wire.cyberdog.chapters.motion.motion import Motion


def begins_in(motion: int) -> Set[Posture]:
    """Return the postures in which ``motion`` can begin."""
    if motion in FIGURES:
        return MOTIONS[FIGURES[motion]].before
    return {Posture.STANDING} if motion in MAY_LAST | USERS else set(Posture)


def entered(robot: Robot) -> Motion | None:
    """Return the state of a body that no client commands."""
    flags = robot[MotionStatus].flags if MotionStatus in robot else MotionFlags()
    if flags.rolled_over:
        return Motion.ON_ITS_BACK
    return Motion.LIFTED if flags.picked_up else None


def under_way(action: Action | None) -> bool:
    """Return whether ``action`` is given and has not ended."""
    return action is not None and not action.status.ended


def of_another(action: Action | None) -> bool:
    """Return whether ``action`` is under way for a client other than the current one."""
    return action is not None and not action.status.ended and action.client != client()
