"""The servo chapter (manual 3.2.12)."""

from __future__ import annotations

import math

from roboglot.model.components.motion.servo import Servos
from roboglot.operations import Right
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import ServoAngle, ServoId, ServoSpeed
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.waiting import ended


@TABLE.on("servo angle", right=Right.DRIVE, needs=(Servos,))
async def set_angle(context: Context, *, id: ServoId, angle: ServoAngle, wait_for_complete: bool = False) -> None:
    """Turn a servo to an angle in degrees (3.2.12.1); answers at once unless ``wait_for_complete`` is true."""
    action = context.robot[Servos].move_to(id, math.radians(angle), source=context.source)
    if wait_for_complete:
        await ended(context, action)


@TABLE.on("servo recenter", right=Right.DRIVE, needs=(Servos,))
async def recenter(context: Context, *, id: ServoId, wait_for_complete: bool = False) -> None:
    """Turn a servo to 0; in no manual, but real robots know it."""
    await set_angle(context, id=id, angle=0.0, wait_for_complete=wait_for_complete)


@TABLE.on("servo speed", right=Right.DRIVE, needs=(Servos,))
def set_speed(context: Context, *, id: ServoId, speed: ServoSpeed) -> None:
    """Keep turning a servo at degrees/s until it is stopped (3.2.12.2)."""
    context.robot[Servos].set_speed(id, math.radians(speed), source=context.source)


@TABLE.on("servo stop", right=Right.DRIVE, needs=(Servos,))
def stop(context: Context, id: ServoId | None = None) -> None:
    """Stop all servos, or the one named (3.2.12.3)."""
    context.robot[Servos].stop(id)


@TABLE.on("servo angle ?", right=Right.SEE, needs=(Servos,))
def get_angle(context: Context, *, id: ServoId) -> tuple[float, ...]:
    """Return the angle of a servo, degrees in [-180, 180] (3.2.12.4)."""
    return (round(math.degrees(context.robot[Servos].angle(id)), 1) + 0.0,)
