"""Odometry, IMU, lidar, network: near the truth, never quite it."""

import math

import msgspec
import numpy as np
import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.network import Network
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import STILL, Pose, Twist
from roboglot.simulation.world.description import Thing
from roboglot.simulation.world.world_files import load_world


async def drive_a_square(sim):
    for _ in range(4):
        sim.robot[Base].set_velocity(Twist(0.8, 0.0, 0.0))
        await sim.clock.advance(5.0)
        sim.robot[Base].set_velocity(Twist(0.0, 0.0, math.pi / 4))
        await sim.clock.advance(2.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)


@pytest.mark.parametrize("seed", [1, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (2, 3))])
async def test_odometry_drifts_but_stays_near(simulate, seed):
    sim = simulate(start=Pose(3, 3), seed=seed)
    sim.world.start()
    await drive_a_square(sim)
    reading = sim.robot[Odometry].reading
    truth = sim.pose.relative_to(Pose(3, 3))
    assert 0.002 < reading.pose.distance_to(truth) < 0.6
    assert reading.distance == pytest.approx(4 * 4.0, rel=0.05)
    assert reading.stamp == pytest.approx(sim.clock.time())


async def test_odometry_stands_still_with_the_robot(simulate):
    sim = simulate()
    sim.world.start()
    await sim.clock.advance(30.0)
    assert sim.robot[Odometry].reading.pose == Pose()


async def test_the_imu_feels_gravity_turning_and_acceleration(simulate):
    sim = simulate(start=Pose(2, 5))
    sim.world.start()
    await sim.clock.advance(1.0)
    assert sim.robot[Imu].reading.linear_acceleration.z == pytest.approx(9.81, abs=0.25)
    sim.robot[Base].set_velocity(Twist(2.0))
    await sim.clock.advance(0.5)
    assert sim.robot[Imu].reading.linear_acceleration.x == pytest.approx(2.0, abs=0.25)
    sim.robot[Base].set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(1.5)
    assert sim.robot[Imu].reading.angular_velocity.z == pytest.approx(1.0, abs=0.03)
    assert sim.robot[Imu].reading.orientation.yaw == pytest.approx(sim.pose.yaw, abs=0.03)
    assert sim.robot[Imu].reading.orientation.yaw != sim.pose.yaw


async def test_the_lidar_sees_the_walls_where_they_are(simulate):
    sim = simulate(start=Pose(4, 3, math.pi / 2))
    sim.world.start()
    await sim.clock.advance(0.1)
    scan = sim.robot[Lidar].scan
    assert scan is not None
    pose = sim.pose
    for angle, distance in zip(scan.angles, scan.ranges, strict=True):
        c, s = math.cos(pose.yaw + angle), math.sin(pose.yaw + angle)
        # the room is 10 x 10 m; the dock protrudes from its western wall
        across = (10 - pose.x) / c if c > 1e-9 else -pose.x / c if c < -1e-9 else math.inf
        along = (10 - pose.y) / s if s > 1e-9 else -pose.y / s if s < -1e-9 else math.inf
        if not (abs(pose.y + s * across - 5.0) < 0.3 and c < 0):
            assert distance == pytest.approx(min(across, along), abs=0.06)


async def test_scans_come_ten_times_second_with_the_odometry(simulate):
    sim = simulate(start=Pose(2, 5))
    scans = sim.robot.events.subscribe(ScanTaken)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(2.0)
    taken = scans.drain()
    assert [event.stamp for event in taken] == pytest.approx([0.1 * i for i in range(1, 21)])
    assert taken[-1].odometry == sim.robot[Odometry].reading.pose
    assert not taken[-1].scan.ranges.flags.writeable


async def test_the_lidars_range_ends(simulate):
    sim = simulate("office", start=Pose(14.0, 10.0))
    sim.world.start()
    await sim.clock.advance(0.1)
    ranges = sim.robot[Lidar].scan.ranges
    assert np.isinf(ranges[180])  # along the corridor: 15.9 m to its end
    assert np.nanmax(ranges[np.isfinite(ranges)]) <= 12.0


async def test_the_lidar_sinks_with_the_body(simulate):
    sim = simulate("office", start=Pose(19.0, 1.0))
    sim.world.start()
    bed = sim.world.stage.add_obstacle(Pose(19.0, 2.0), (0.5, 0.1, 0.25))  # too low for a standing robot
    await sim.clock.advance(0.1)
    assert sim.robot[Lidar].scan.ranges[270] > 1.5
    sim.robot[Legs].lie_down()
    await sim.clock.advance(2.0)
    assert sim.robot[Lidar].scan.ranges[270] == pytest.approx(0.95, abs=0.05)
    sim.world.stage.remove_obstacle(bed)
    await sim.clock.advance(0.1)
    assert sim.robot[Lidar].scan.ranges[270] > 1.5


async def test_the_lidar_sees_other_robots_and_not_itself(simulate):
    sim = simulate(start=Pose(3, 5), robots=("a", "b"))
    sim.world.stage.place("b", Pose(5, 5))
    sim.world.start()
    await sim.clock.advance(0.1)
    assert sim.robot[Lidar].scan.ranges[180] == pytest.approx(1.75, abs=0.05)
    assert sim.robots["b"][Lidar].scan.ranges[0] == pytest.approx(1.75, abs=0.05)
    assert sim.robot[Lidar].scan.ranges.min() > 1.0


async def test_reception_falls_with_distance_and_walls(simulate):
    sim = simulate("office", start=Pose(10.0, 10.5))
    sim.world.start()
    await sim.clock.advance(1.1)
    near = sim.robot[Network].signal
    sim.world.stage.place("a", Pose(28.0, 10.5))
    await sim.clock.advance(1.1)
    far = sim.robot[Network].signal
    sim.world.stage.place("a", Pose(28.0, 13.5))
    await sim.clock.advance(1.1)
    behind_walls = sim.robot[Network].signal
    assert -40 < near < -25
    assert far < near - 15
    assert behind_walls < far - 3
    assert behind_walls > -95


async def test_a_tall_thing_is_seen_and_touched_softly(simulate):
    empty = load_world("empty")
    bin_ = Thing("bin", at=(7.0, 5.0), diameter=0.4, height=0.5, mass=2.0)
    sim = simulate(msgspec.structs.replace(empty, floors=[msgspec.structs.replace(empty.floors[0], things=[bin_])]))
    sim.world.stage.place("a", Pose(5.0, 5.0))
    sim.world.start()
    await sim.clock.advance(0.5)
    ahead = len(sim.robot[Lidar].scan.ranges) // 2
    assert sim.robot[Lidar].scan.ranges[ahead] == pytest.approx(1.8, abs=0.05)
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(3.0)
    assert sim.robot[Base].velocity.x < 0.2  # noticed in advance
