"""The chassis chapter: speeds, wheels, moves, queries and pushes (manual 3.2.3)."""

from __future__ import annotations

import math

from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import FollowMode
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import Refused
from roboglot.model.geometry import STILL, Twist
from roboglot.operations import Right
from roboglot.protocols.robomaster import readings
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.ranges import (
    AngleZ,
    DistanceXY,
    Rate,
    SpeedXY,
    SpeedZ,
    Switch,
    TopSpeedXY,
    TopSpeedZ,
    WheelSpeed,
)
from roboglot.protocols.robomaster.table import TABLE
from roboglot.protocols.robomaster.vocabulary import offset_of, twist_of, wheels_of, without_yaw
from roboglot.protocols.robomaster.waiting import ended

LET_GO_AFTER = 0.5  # s for which a stop command keeps the base, so that a joystick's zero leaves no gap


def _drive(context: Context, command: Twist | WheelSpeeds) -> None:
    """Drive at ``command`` until the next one, the end of the session or a command of another door."""
    still = command in (STILL, WheelSpeeds())
    context.robot[Driving].drive(command, lifetime=LET_GO_AFTER if still else None, source=context.source)


@TABLE.on("chassis speed", right=Right.DRIVE, needs=(Driving,))
def set_speed(context: Context, *, x: SpeedXY = 0.0, y: SpeedXY = 0.0, z: SpeedZ = 0.0) -> None:
    """Drive at x, y m/s and z degrees/s until the next command; a missing axis is 0 (3.2.3.1).

    In gimbal_lead z is ignored: the chassis follows the gimbal.
    """
    _drive(context, twist_of(x, y, 0.0 if context.mode is FollowMode.GIMBAL_LEAD else z))


@TABLE.on("chassis wheel", right=Right.DRIVE, needs=(Driving,))
def set_wheels(
    context: Context, *, w1: WheelSpeed = 0.0, w2: WheelSpeed = 0.0, w3: WheelSpeed = 0.0, w4: WheelSpeed = 0.0
) -> None:
    """Turn the wheels (front right, front left, rear right, rear left) at these rpm (3.2.3.2).

    In gimbal_lead the turning component is removed; real robots refuse the command then.
    """
    as_robots = context.profile.as_robots
    speeds = wheels_of(round(w1), round(w2), round(w3), round(w4), as_robots)
    if context.mode is FollowMode.GIMBAL_LEAD:
        if as_robots:
            raise Refused("single wheels cannot be driven in gimbal_lead")
        speeds = without_yaw(speeds)
    _drive(context, speeds)


@TABLE.on("chassis move", right=Right.DRIVE, needs=(Driving,))
async def move(
    context: Context,
    *,
    x: DistanceXY = 0.0,
    y: DistanceXY = 0.0,
    z: AngleZ = 0.0,
    vxy: TopSpeedXY = 0.5,
    vz: TopSpeedZ = 30.0,
    wait_for_complete: bool = False,
) -> None:
    """Move by x, y m and z degrees; answers at once, or at the end if ``wait_for_complete`` is true (3.2.3.3)."""
    turn = 0.0 if context.mode is FollowMode.GIMBAL_LEAD else z  # there the chassis follows the gimbal
    action = context.robot[Driving].move_by(
        offset_of(x, y, turn), speed=vxy, yaw_speed=math.radians(vz), source=context.source
    )
    if wait_for_complete:
        await ended(context, action)


@TABLE.on("chassis stop", right=Right.DRIVE, needs=(Driving,))
def stop(context: Context) -> None:
    """Stop; in no manual, but real robots and their users know it."""
    _drive(context, STILL)


@TABLE.on("chassis speed ?", right=Right.SEE, needs=(Base, Odometry))
def get_speed(context: Context) -> tuple[float | int, ...]:
    """Return x y m/s, z degrees/s and four wheels in rpm (3.2.3.4)."""
    return readings.speed(context)


@TABLE.on("chassis position ?", right=Right.SEE, needs=(Odometry,))
def get_position(context: Context) -> tuple[float, ...]:
    """Return x y m and z degrees since power-on (3.2.3.5)."""
    return readings.position(context)


@TABLE.on("chassis attitude ?", right=Right.SEE, needs=(Imu,))
def get_attitude(context: Context) -> tuple[float, ...]:
    """Return pitch roll yaw in degrees (3.2.3.6)."""
    return readings.attitude(context.robot)


@TABLE.on("chassis status ?", right=Right.SEE, needs=(MotionStatus,))
def get_status(context: Context) -> tuple[int, ...]:
    """Return eleven flags of 0 or 1 (3.2.3.7)."""
    return readings.status(context.robot)


@TABLE.on("chassis push", right=Right.SEE)
def push(
    context: Context,
    *,
    position: Switch | None = None,
    pfreq: Rate | None = None,
    attitude: Switch | None = None,
    afreq: Rate | None = None,
    status: Switch | None = None,
    sfreq: Rate | None = None,
    freq: Rate | None = None,
) -> None:
    """Switch the attributes' pushes on and off and set their rates in Hz; ``freq`` overrides the others (3.2.3.8)."""
    switches = {"on": True, "off": False, "": None, None: None}
    for name, switch, rate in (("position", position, pfreq), ("attitude", attitude, afreq), ("status", status, sfreq)):
        context.pushes.switch("chassis", name, switches[switch], freq or rate)
