"""A simulated EP behind its text door, a driver connected to it, and REST in front."""

import asyncio
import math

import numpy as np
import pytest
from msgspec import Struct

from roboglot.clients.slamware import SlamwareClient, SlamwareRefused
from roboglot.drivers.robomaster.capabilities import APPROXIMATIONS
from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.members import Members
from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_library import MapLibrary
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.places import Places
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal, GimbalFrame
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.ledger import Ledger
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from roboglot.wire.slamware.chapters.motion import AngleOptions, Direction, MoveByOptions
from tests.drivers.clients import OpenRest

pytestmark = pytest.mark.world("empty", body="robomaster_ep")


async def do(client: SlamwareClient, forward: Forward, name: str, options: Struct) -> None:
    """An action of the REST API, to its end."""
    action = await client.begin(name, options)
    waiting = asyncio.ensure_future(action.succeeded())
    for _ in range(100):
        await forward(seconds=0.1)
        if waiting.done():
            break
    await waiting


async def test_rest_drives_an_asymmetric_path(driven_ep: Robot, rest: OpenRest, world: World, forward: Forward) -> None:
    client, start = await rest(driven_ep), world.truth.pose_of("a")
    await do(client, forward, "MoveByAction", MoveByOptions(Direction.FORWARD, duration=2000))
    ahead = world.truth.pose_of("a").relative_to(start)
    assert ahead.x == pytest.approx(0.4 * 2, abs=0.1)
    await do(client, forward, "RotateAction", AngleOptions(math.pi / 2))
    assert_pose(world.truth.pose_of("a").relative_to(start), x=ahead.x, y=ahead.y, deg=90)
    await do(client, forward, "MoveByAction", MoveByOptions(Direction.FORWARD, duration=1000))
    left = world.truth.pose_of("a").relative_to(start)
    assert left.y == pytest.approx(0.4, abs=0.1)
    reported = await client.get_odo_pose()
    here = driven_ep[Odometry].reading.pose
    assert (reported.x, reported.y, reported.yaw) == pytest.approx((here.x, here.y, here.yaw), abs=0.01)


@pytest.mark.slow  # in short: test_rest_drives_an_asymmetric_path
async def test_square_and_side_step_end_where_they_should(driven_ep: Robot, world: World, forward: Forward) -> None:
    start = world.truth.pose_of("a")

    async def move(offset: Pose) -> None:
        action = driven_ep[Driving].move_by(offset, source="test")
        for _ in range(25):
            if not action.status.ended:
                await forward(seconds=0.2)
        assert action.status is ActionStatus.SUCCEEDED, action.reason

    for offset in (Pose(0.3), Pose(yaw=math.pi / 2)) * 4:
        await move(offset)
    assert_pose(world.truth.pose_of("a").relative_to(start), x=0.0, y=0.0, deg=0.0)
    await move(Pose(0.2, 0.4, 0.5))
    assert_pose(world.truth.pose_of("a").relative_to(start), x=0.2, y=0.4, deg=math.degrees(0.5))


@pytest.mark.slow
async def test_drifting_attitude_at_rest_bends_no_way(
    driven_ep: Robot, robot: Robot, world: World, forward: Forward, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robot[Imu], "_bias", np.array([0.0, 0.0, 0.006, 0.0, 0.0, 0.0]))
    await forward(seconds=14)
    assert robot[Imu].reading.orientation.yaw > 0.07
    assert robot[Odometry].reading.pose.yaw < 0.01
    start = world.truth.pose_of("a")
    action = driven_ep[Driving].move_by(Pose(0.8), source="test")
    await forward(seconds=3)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(world.truth.pose_of("a").relative_to(start), x=0.8, y=0.0, deg=0.0)


async def test_reports_are_in_the_models_units(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    driven_ep[Driving].drive(Twist(x=0.3, y=0.2, yaw=0.5), source="test")
    await forward(seconds=2)
    twist, real = driven_ep[Odometry].reading.twist, robot[Odometry].reading.twist
    assert (twist.x, twist.y, twist.yaw) == pytest.approx((real.x, real.y, real.yaw), abs=0.05)
    assert twist.y > 0.1
    wheels, turning = driven_ep[Base].wheel_speeds, robot[Base].wheel_speeds
    assert wheels.front_left == pytest.approx(turning.front_left, abs=1)
    assert wheels.rear_right == pytest.approx(turning.rear_right, abs=1)
    assert driven_ep[Imu].reading.angular_velocity.z == pytest.approx(0.5, abs=0.15)
    assert driven_ep[Imu].reading.linear_acceleration.z == pytest.approx(9.81, abs=0.1)
    assert driven_ep[Battery].state.percentage == pytest.approx(robot[Battery].state.percentage, abs=0.01)
    assert driven_ep[Link].age("position") <= 0.021  # pushed at 50 Hz
    assert driven_ep.description.maker == "DJI"


async def test_single_wheels_turn(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    driven_ep[Driving].drive(WheelSpeeds(front_left=5, front_right=-5, rear_left=5, rear_right=-5), source="test")
    await forward(seconds=1)
    assert robot[Base].velocity.yaw < -0.3  # left wheels ahead: it turns clockwise


async def test_the_gimbal_turns_the_models_way(driven_ep: Robot, robot: Robot, forward: Forward) -> None:
    gimbal, real = driven_ep[Gimbal], robot[Gimbal]
    gimbal.set_mode(FollowMode.FREE)
    await forward(seconds=0.2)
    assert (gimbal.mode, real.mode) == (FollowMode.FREE, FollowMode.FREE)
    action = gimbal.move_to(pitch=-0.3, yaw=0.6, frame=GimbalFrame.WORLD, source="test")
    await forward(seconds=3)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert (real.attitude.pitch, real.attitude.yaw) == pytest.approx((-0.3, 0.6), abs=0.03)
    action = gimbal.set_speed(0.0, 1.0, source="test")
    await forward(seconds=1)
    action.cancel()
    await forward(seconds=0.5)
    assert action.status is ActionStatus.CANCELED
    still = real.attitude.yaw
    assert still > 1.3
    await forward(seconds=1)
    assert real.attitude.yaw == pytest.approx(still, abs=0.03)


async def test_missing_parts_are_missing_in_the_other_door(driven_ep: Robot, rest: OpenRest) -> None:
    client = await rest(driven_ep)
    assert Lidar not in driven_ep
    assert Localization not in driven_ep
    with pytest.raises(SlamwareRefused, match="501"):
        await client.get_pose()
    assert (await client.get_power_status()).battery_percentage > 0


async def test_it_announces_what_it_adds(driven_ep: Robot) -> None:
    kept_here = {Lease, Places, MapAnnotations, MapMemory, MapLibrary, FileStore, Settings, Ledger, Members}
    assert set(driven_ep.interfaces) - kept_here == APPROXIMATIONS.keys()
