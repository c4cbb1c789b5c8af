"""What the robot says about its chassis, in the EP's units, signs and order (manual 3.2.3.4 to 3.2.3.9)."""

from __future__ import annotations

import math

from roboglot.model.components.base import Base
from roboglot.model.components.bumper import Bumper
from roboglot.model.components.driving import BASE
from roboglot.model.components.imu import Imu
from roboglot.model.components.odometry import Odometry
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.vocabulary import wheels_in_rpm

STATIC_SPEED = 0.01  # m/s below which it counts as standing
STATIC_YAW_RATE = math.radians(1.0)
SLOPE = math.radians(5.0)  # tilt from which the floor counts as a slope
ROLLED_OVER = math.radians(60.0)


def position(robot: Robot) -> tuple[float, float, float]:
    """x m, y m, z degrees since power-on, by odometry (so it drifts); z in (-180, 180]."""
    pose = robot[Odometry].reading.pose
    return pose.x, -pose.y, -math.degrees(pose.yaw)


def attitude(robot: Robot) -> tuple[float, float, float]:
    """pitch, roll, yaw in degrees by the IMU, yaw since power-on."""
    orientation = robot[Imu].reading.orientation
    return -math.degrees(orientation.pitch), math.degrees(orientation.roll), -math.degrees(orientation.yaw)


def speed(robot: Robot) -> tuple[float | int, ...]:
    """x m/s, y m/s, z degrees/s as odometry measures them, and the four wheels in whole rpm."""
    twist = robot[Odometry].reading.twist
    return (twist.x, -twist.y, -math.degrees(twist.yaw), *wheels_in_rpm(robot[Base].wheel_speeds))


def status(robot: Robot) -> tuple[int, ...]:
    """Eleven flags: static, uphill, downhill, on_slope, pick_up, slip, impact_x, _y, _z, roll_over, hill_static.

    Slopes and rolling over are the IMU's tilt, impacts the bumper's contacts, sliding down a slope is motion on it that
    nobody asked for. pick_up, slip and impact_z stay 0: nothing in the model senses them.
    """
    twist = robot[Odometry].reading.twist
    orientation = robot[Imu].reading.orientation
    tilt = math.hypot(orientation.pitch, orientation.roll)
    sloping = SLOPE < tilt < ROLLED_OVER
    static = twist.speed < STATIC_SPEED and abs(twist.yaw) < STATIC_YAW_RATE
    climb = -twist.x * math.sin(orientation.pitch) + twist.y * math.sin(orientation.roll)
    touching = robot[Bumper].pressed if Bumper in robot else frozenset()
    flags = (
        static,
        sloping and not static and climb > 0,
        sloping and not static and climb < 0,
        sloping and not static and climb < 0 and not robot.actions.running(BASE),
        False,
        False,
        any(zone.startswith(("front", "rear")) for zone in touching),
        any("left" in zone or "right" in zone for zone in touching),
        False,
        tilt >= ROLLED_OVER,
        sloping and static,
    )
    return tuple(int(flag) for flag in flags)
