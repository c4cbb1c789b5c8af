"""The gimbal chapter (manual 3.2.4). Pitch is positive upwards, yaw to the right; angles in degrees.

Pitch is relative to the horizon; yaw is the joint's angle to the chassis, whose travel is the manual's range.
"""

from __future__ import annotations

import math

from roboglot.model.actions import Action
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal, GimbalFrame
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.operations import Right
from roboglot.protocols.robomaster import readings
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import (
    GimbalSpeed,
    GimbalTopSpeed,
    PitchBy,
    PitchTo,
    Rate,
    Switch,
    YawBy,
    YawTo,
)
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.waiting import ended

THERE = math.radians(0.5)


@TABLE.on("gimbal speed", right=Right.DRIVE, needs=(Gimbal,))
def set_speed(context: Context, *, p: GimbalSpeed = 0.0, y: GimbalSpeed = 0.0) -> None:
    """Turn at p and y degrees/s until the next command (3.2.4.1); in chassis_lead y has no effect, as robots say."""
    idle_yaw = context.mode is FollowMode.CHASSIS_LEAD
    gimbal = context.robot[Gimbal]
    gimbal.set_speed(-math.radians(p), 0.0 if idle_yaw else -math.radians(y), source=context.source)
    if idle_yaw and y and context.profile.as_robots:
        raise Refused("in chassis_lead the gimbal's yaw follows the chassis; pitch is done")


@TABLE.on("gimbal move", right=Right.DRIVE, needs=(Gimbal,))
async def move(
    context: Context,
    *,
    p: PitchBy = 0.0,
    y: YawBy = 0.0,
    vp: GimbalTopSpeed = 30.0,
    vy: GimbalTopSpeed = 30.0,
    wait_for_complete: bool = True,
) -> None:
    """Turn by p and y degrees, at up to vp and vy degrees/s (3.2.4.2).

    Answers at the end unless ``wait_for_complete`` is false, as real robots do. In chassis_lead y has no effect.
    """
    turn = 0.0 if context.mode is FollowMode.CHASSIS_LEAD else y
    action = context.robot[Gimbal].move_by(
        pitch=-math.radians(p),
        yaw=-math.radians(turn),
        pitch_speed=_top("vp", vp) if p else None,
        yaw_speed=_top("vy", vy) if turn else None,
        source=context.source,
    )
    await _finish(context, action, wait_for_complete)


@TABLE.on("gimbal moveto", right=Right.DRIVE, needs=(Gimbal,))
async def move_to(
    context: Context,
    *,
    p: PitchTo | None = None,
    y: YawTo | None = None,
    vp: GimbalTopSpeed = 30.0,
    vy: GimbalTopSpeed = 30.0,
    wait_for_complete: bool = True,
) -> None:
    """Turn to p relative to the horizon and y relative to the chassis (3.2.4.3); otherwise as ``gimbal move``."""
    gimbal = context.robot[Gimbal]
    pitch = None if p is None else -math.radians(p)
    yaw = None if y is None or context.mode is FollowMode.CHASSIS_LEAD else -math.radians(y)
    if not vp and _near(pitch, gimbal.attitude.pitch):
        pitch = None
    if not vy and _near(yaw, gimbal.angles.yaw):
        yaw = None
    action = gimbal.move_to(
        pitch=pitch,
        yaw=yaw,
        frame=GimbalFrame.STABILIZED,
        pitch_speed=None if pitch is None else _top("vp", vp),
        yaw_speed=None if yaw is None else _top("vy", vy),
        source=context.source,
    )
    await _finish(context, action, wait_for_complete)


@TABLE.on("gimbal recenter", right=Right.DRIVE, needs=(Gimbal,))
async def recenter(context: Context, *, wait_for_complete: bool = True) -> None:
    """Turn both axes to the chassis' front (3.2.4.6)."""
    await _finish(context, context.robot[Gimbal].recenter(source=context.source), wait_for_complete)


@TABLE.on("gimbal stop", right=Right.DRIVE, needs=(Gimbal,))
def stop(context: Context) -> None:
    """Stop and hold the angles; in no manual, but real robots know it."""
    context.robot[Gimbal].set_speed(0.0, 0.0, source=context.source)


@TABLE.on("gimbal suspend", right=Right.DRIVE, needs=(Gimbal,))
def suspend(context: Context) -> None:
    """Release the motors; until ``gimbal resume`` (or the session's end) it takes no commands (3.2.4.4)."""
    gimbal = context.robot[Gimbal]
    gimbal.suspend()
    context.at_end("gimbal suspend", gimbal.resume)


@TABLE.on("gimbal resume", right=Right.DRIVE, needs=(Gimbal,))
def resume(context: Context) -> None:
    """Power the motors again (3.2.4.5)."""
    context.robot[Gimbal].resume()


@TABLE.on("gimbal attitude ?", right=Right.SEE, needs=(Gimbal,))
def get_attitude(context: Context) -> tuple[float, ...]:
    """Return pitch yaw, in the frame of ``gimbal moveto`` (3.2.4.7)."""
    return readings.gimbal_attitude(context.robot)


@TABLE.on("gimbal push", right=Right.SEE, needs=(Gimbal,))
def push(
    context: Context, *, attitude: Switch | None = None, afreq: Rate | None = None, freq: Rate | None = None
) -> None:
    """Switch pushes of the attitude, at afreq Hz (3.2.4.8); rates without the attribute's switch are refused."""
    context.robot.require(Gimbal)
    if not attitude:
        raise InvalidGoal("say which attribute, and on or off: `gimbal push attitude on afreq 10`")
    context.pushes.switch("gimbal", "attitude", attitude == "on", afreq or freq)


def _near(goal: float | None, now: float) -> bool:
    """Return whether an axis is at its goal already, and so needs no speed."""
    return goal is not None and abs(goal - now) <= THERE


def _top(name: str, speed: float) -> float:
    """Return a top speed in rad/s. Raises InvalidGoal for 0."""
    if not speed:
        raise InvalidGoal(f"with {name} 0 it would never arrive; did you mean `{name} 30`?")
    return math.radians(speed)


async def _finish(context: Context, action: Action, wait: bool) -> None:
    if wait:
        await ended(context, action)
