"""Skills that follow from a robot's parts, without waiting for a compiler."""

from __future__ import annotations

import asyncio

from roboglot.autonomy import Autonomy
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base, BaseLimits, WheelSpeeds
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import STILL, Point, Pose, Twist
from roboglot.model.robot import Description, Robot
from roboglot.model.sensing import LaserScan, OdometryReading
from tests.narrowing import of_kind


class Still(Base, Odometry, Lidar):
    """Stands there and sees nothing."""

    limits = BaseLimits(twist=Twist(1.0, 1.0, 2.0), linear_acceleration=1.5, angular_acceleration=4.0)
    rate = 10.0

    def set_velocity(self, twist: Twist) -> None: ...

    def set_wheel_speeds(self, speeds: WheelSpeeds) -> None: ...

    wheel_speeds = WheelSpeeds()
    velocity = STILL
    reading = OdometryReading(0.0, Pose(1.0, 2.0, 0.5), STILL, 0.0)
    scan: LaserScan | None = None


def robot_on(clock: RealClock | LockstepClock, *interfaces: type) -> Robot:
    plate = Description(
        maker="m", model="m", serial="s", hardware_version="1", software_version="1", radius=0.25, height=0.3
    )
    robot, part = Robot("a", plate, clock), Still()
    for interface in interfaces:
        robot.add(interface, part)
    return robot


def test_skills_follow_from_parts() -> None:
    nothing, wheels = robot_on(LockstepClock()), robot_on(LockstepClock(), Base, Odometry)
    seeing = robot_on(LockstepClock(), Base, Odometry, Lidar)
    for robot in (nothing, wheels, seeing):
        Autonomy(robot)
    assert Driving not in nothing
    assert Driving in wheels
    assert Navigation not in wheels
    assert {Driving, Localization, Mapping, Navigation} <= set(seeing.interfaces)
    assert Docking not in seeing


async def test_navigation_waits_for_kernels_start_does_not() -> None:
    robot = robot_on(RealClock(50.0), Base, Odometry, Lidar)
    autonomy = Autonomy(robot)
    await autonomy.start(wait=False)
    assert not autonomy.ready
    assert robot[Localization].pose == Pose(1.0, 2.0, 0.5)  # odometry
    assert robot[Mapping].grid.width == 0
    action = robot[Navigation].navigate_to([Point(1.0, 1.0)], NavigationOptions())
    await asyncio.sleep(0.05)
    assert of_kind(action.feedback, NavigationFeedback).stage == "planning"
    action.cancel()
    await action.done()
    await autonomy.start(wait=True)
    await autonomy.close()


async def test_start_waits_when_asked_to() -> None:
    autonomy = Autonomy(robot_on(LockstepClock(), Base, Odometry, Lidar))
    await autonomy.start(wait=True)
    assert autonomy.ready
    await autonomy.close()
