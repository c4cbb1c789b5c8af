"""Motion status on ramps, bumps, steps and ice, in hands, and upside down."""

import math

import pytest

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import STILL, Pose, Twist, Vector3
from tests.masking import mask_bumper

SLOPE = math.atan(0.4 / 1.5)


@pytest.fixture
def course(simulate):
    async def build(start, **more):
        sim = simulate("obstacle_course", start=start, body="robomaster_ep", **more)
        sim.world.start()
        await sim.clock.advance(1.0)
        return sim

    return build


def flags(sim):
    return sim.robot[MotionStatus].flags


async def during(sim, seconds):
    """All flags that were reported meanwhile."""
    reported = set()
    for _ in range(round(seconds / 0.1)):
        await sim.clock.advance(0.1)
        reported |= {name for name in MotionFlags.__slots__ if getattr(flags(sim), name)}
    return reported


async def test_at_rest_on_level_ground(course):
    sim = await course(Pose(1.5, 4.0))
    assert flags(sim) == MotionFlags(static=True)
    sim.robot[Base].set_velocity(Twist(0.3))
    await sim.clock.advance(1.0)
    assert flags(sim) == MotionFlags(static=False)


async def test_up_a_ramp_over_the_top_and_down(course):
    sim = await course(Pose(3.6, 4.0))
    assert flags(sim) == MotionFlags(static=True, static_on_slope=True)
    assert sim.robot[Imu].reading.orientation.pitch == pytest.approx(-SLOPE, abs=0.01)
    assert sim.robot[Imu].reading.linear_acceleration.x == pytest.approx(9.81 * math.sin(SLOPE), abs=0.2)
    before = sim.pose.x
    await sim.clock.advance(3.0)
    assert sim.pose.x == pytest.approx(before, abs=0.005)  # held by the wheels
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(1.0)
    assert flags(sim) == MotionFlags(static=False, uphill=True)
    await sim.clock.advance(1.5)
    assert flags(sim) == MotionFlags(static=False)  # on the platform
    await sim.clock.advance(4.0)
    assert flags(sim) == MotionFlags(static=False, downhill=True)
    await sim.clock.advance(3.0)
    assert flags(sim) == MotionFlags(static=False)
    assert sim.robot[Imu].reading.orientation.pitch == pytest.approx(0.0, abs=0.01)


async def test_backwards_down_and_across(course):
    sim = await course(Pose(4.0, 4.0))
    sim.robot[Base].set_velocity(Twist(-0.3))
    await sim.clock.advance(1.0)
    assert flags(sim).downhill
    sim.world.stage.place("a", Pose(3.8, 4.0, math.pi / 2))  # the slope falls to its left
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    assert sim.robot[Imu].reading.orientation.roll == pytest.approx(-SLOPE, abs=0.01)
    assert flags(sim).static_on_slope


async def test_the_wheels_measure_along_the_slope(course):
    sim = await course(Pose(3.4, 4.0))
    begun, way = sim.pose.x, sim.robot[Odometry].reading.distance
    sim.robot[Base].set_velocity(Twist(0.4))
    await sim.clock.advance(2.0)
    along = (sim.pose.x - begun) / math.cos(SLOPE)
    assert sim.robot[Odometry].reading.distance - way == pytest.approx(along, rel=0.05)


async def test_ice_is_slippery(course):
    sim = await course(Pose(7.2, 6.7))
    begun = sim.pose.x
    sim.robot[Base].set_velocity(Twist(2.0))
    reported = await during(sim, 0.8)
    assert "slipping" in reported
    assert sim.pose.x - begun < 0.3  # on a dry floor it would be more than 1 m
    await sim.clock.advance(3.0)


async def test_on_icy_slopes_it_slides_down(course):
    sim = await course(Pose(2.2, 6.7))
    sim.world.stage.place("a", Pose(4.0, 6.7))
    await sim.clock.advance(0.4)
    assert flags(sim).sliding
    assert flags(sim).slipping
    assert not flags(sim).static
    assert sim.pose.x < 3.95


async def test_a_bump_shakes_and_is_crossed(course):
    sim = await course(Pose(4.0, 1.5))
    sim.robot[Base].set_velocity(Twist(1.5))
    reported = await during(sim, 1.4)
    assert "impact_z" in reported
    assert sim.pose.x > 5.2
    assert not flags(sim).impact_z  # reported for a moment


async def test_low_step_is_climbed_high_one_is_not(course):
    sim = await course(Pose(6.0, 1.5))
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(1.2)
    assert sim.world.truth.height_of("a") == pytest.approx(0.006, abs=0.001)
    reported = await during(sim, 2.5)
    assert sim.pose.x == pytest.approx(9.0 - 0.15, abs=0.02)  # front wheels at its edge
    assert {"impact_x", "slipping"} <= reported
    assert "impact_y" not in reported


async def test_driving_off_an_edge_is_a_fall(course):
    sim = await course(Pose(9.5, 1.5))
    assert sim.world.truth.height_of("a") == pytest.approx(0.08, abs=0.001)
    sim.robot[Base].set_velocity(Twist(2.0))
    reported = await during(sim, 1.2)
    assert "impact_z" in reported


@pytest.mark.parametrize("world", ["empty", "obstacle_course"])
async def test_a_hand_lifts_the_robot_and_lets_go(simulate, world):
    sim = simulate(world, start=Pose(2.0, 3.5), body="robomaster_ep")
    sim.world.start()
    await sim.clock.advance(0.5)
    sim.world.stage.lift("a", 0.4)
    await sim.clock.advance(1.5)
    assert sim.world.truth.height_of("a") == pytest.approx(0.4, abs=0.01)
    assert flags(sim) == MotionFlags(static=True, picked_up=True)
    before = sim.pose
    sim.robot[Base].set_velocity(Twist(1.0, 0.0, 1.0))
    await sim.clock.advance(1.0)
    assert sim.pose.distance_to(before) < 0.005  # the wheels spin in the air
    assert flags(sim).picked_up
    assert not flags(sim).slipping
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    sim.world.stage.let_go("a")
    await sim.clock.advance(0.4)
    assert flags(sim).impact_z
    assert not flags(sim).picked_up
    assert sim.world.truth.height_of("a") == pytest.approx(0.0, abs=0.002)
    await sim.clock.advance(1.0)
    assert flags(sim) == MotionFlags(static=True)
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(1.0)
    assert sim.pose.x > before.x + 0.3  # and it drives again


@pytest.mark.parametrize(("blow", "flag"), [(Vector3(x=3.0), "impact_x"), (Vector3(y=-3.0), "impact_y")])
async def test_a_push_is_felt_along_its_axis(simulate, blow, flag):
    sim = simulate(start=Pose(5, 5, 0.8), body="robomaster_ep")
    sim.world.start()
    await sim.clock.advance(0.5)
    sim.world.stage.push("a", blow)
    await sim.clock.advance(0.1)
    reported = {name for name in ("impact_x", "impact_y", "impact_z") if getattr(flags(sim), name)}
    assert reported == {flag}
    moved = sim.pose.relative_to(Pose(5, 5, 0.8))
    assert math.hypot(moved.x, moved.y) > 0.02
    await sim.clock.advance(0.5)
    assert flags(sim) == MotionFlags(static=True)


@pytest.mark.parametrize("world", ["empty", "obstacle_course"])
async def test_upside_down_it_drives_no_more(simulate, world):
    sim = simulate(world, start=Pose(2.0, 3.5), body="robomaster_ep")
    sim.world.start()
    await sim.clock.advance(0.5)
    sim.world.stage.roll_over("a")
    sim.robot[Base].set_velocity(Twist(0.5))
    before = sim.pose
    await sim.clock.advance(1.0)
    assert flags(sim).rolled_over
    assert not flags(sim).picked_up
    assert sim.robot[Imu].reading.linear_acceleration.z == pytest.approx(-9.81, abs=0.3)
    assert sim.pose.distance_to(before) < 0.005
    sim.world.stage.roll_over("a", 0.0)
    await sim.clock.advance(1.0)
    assert not flags(sim).rolled_over
    assert sim.pose.distance_to(before) > 0.3


async def test_pushing_against_a_wall_is_slipping(simulate):
    sim = simulate(start=Pose(9.0, 5), body="robomaster_ep")
    mask_bumper(sim.robot)
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(2.0)
    assert flags(sim).slipping
    assert flags(sim).static
