"""The robotic arm chapter (manual 3.2.13).

The manual measures in cm from the position at power-on, real robots in mm from the shoulder.
"""

from __future__ import annotations

import math

from roboglot.model.actions import Action
from roboglot.model.components.motion.arm import Arm, ArmPosition
from roboglot.model.errors import InvalidGoal
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import ArmDistance
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.waiting import ended

CENTIMETRE, MILLIMETRE = 0.01, 0.001


def _scale(context: Context) -> tuple[float, ArmPosition]:
    """Return metres per unit, and the origin."""
    if context.profile.as_robots:
        return MILLIMETRE, ArmPosition()
    return CENTIMETRE, context.robot[Arm].home  # its position at power-on


def _go(context: Context, goal: ArmPosition, command: str, start: ArmPosition) -> Action:
    """Go to ``goal``; out of reach, InvalidGoal names the nearest ``command`` (which counts from ``start``)."""
    arm = context.robot[Arm]
    try:
        return arm.move_to(goal, source=context.source)
    except InvalidGoal:
        unit, low, high = _scale(context)[0], arm.reach.lowest, arm.reach.highest
        x, z = min(max(goal.x, low.x), high.x), min(max(goal.z, low.z), high.z)
        share = min(1.0, arm.reach.radius / math.hypot(x, z))
        near = ((x * share - start.x) / unit, (z * share - start.z) / unit)
        words = " ".join(f"{axis} {math.trunc(value * 10) / 10:g}" for axis, value in zip("xy", near, strict=True))
        raise InvalidGoal(f"that is out of the arm's reach; did you mean `{command} {words}`?") from None


async def _finish(context: Context, action: Action, wait: bool) -> None:
    if wait:
        await ended(context, action)


@TABLE.on("robotic_arm move", right=Right.DRIVE, needs=(Arm,))
async def move(context: Context, *, x: ArmDistance, y: ArmDistance, wait_for_complete: bool = False) -> None:
    """Move the end point by x forward and y up; `fail` beyond the arm's reach (3.2.13.1)."""
    unit, _ = _scale(context)
    now = context.robot[Arm].position
    goal = ArmPosition(now.x + x * unit, now.z + y * unit)
    await _finish(context, _go(context, goal, "robotic_arm move", now), wait_for_complete)


@TABLE.on("robotic_arm moveto", right=Right.DRIVE, needs=(Arm,))
async def move_to(context: Context, *, x: ArmDistance, y: ArmDistance, wait_for_complete: bool = False) -> None:
    """Move the end point to x, y (3.2.13.2)."""
    unit, origin = _scale(context)
    goal = ArmPosition(origin.x + x * unit, origin.z + y * unit)
    await _finish(context, _go(context, goal, "robotic_arm moveto", origin), wait_for_complete)


@TABLE.on("robotic_arm recenter", right=Right.DRIVE, needs=(Arm,))
async def recenter(context: Context, *, wait_for_complete: bool = False) -> None:
    """Return to the position at power-on (3.2.13.3)."""
    await _finish(context, context.robot[Arm].recenter(source=context.source), wait_for_complete)


@TABLE.on("robotic_arm stop", right=Right.DRIVE, needs=(Arm,))
def stop(context: Context) -> None:
    """Stop and hold the position (3.2.13.4)."""
    context.robot[Arm].stop()


@TABLE.on("robotic_arm position ?", right=Right.SEE, needs=(Arm,))
def get_position(context: Context) -> tuple[float | int, ...]:
    """Return x y of the end point (3.2.13.5); real robots: whole mm."""
    unit, origin = _scale(context)
    now = context.robot[Arm].position
    x, y = (now.x - origin.x) / unit, (now.z - origin.z) / unit
    return (round(x), round(y)) if context.profile.as_robots else (x, y)
