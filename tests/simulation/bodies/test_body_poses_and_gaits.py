"""Body poses, gaits, and steps over obstacles."""

from __future__ import annotations

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gaits import GAITS, Gait
from roboglot.model.components.motion.legs import (
    BodyPose,
    FootLift,
    Legs,
    Posture,
    Step,
)
from roboglot.model.components.sensing.camera import Camera
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import STILL, Orientation, Point, Pose, Twist


@pytest.fixture
def dog(simulate):
    sim = simulate(start=Pose(2, 5), body="cyberdog2")
    sim.world.start()
    return sim


async def test_holds_a_pose_and_the_imu_feels_it(dog):
    legs = dog.robot[Legs]
    action = legs.hold(BodyPose(0.28, Orientation(roll=0.2, pitch=-0.3, yaw=0.1)), duration=1.0)
    await dog.clock.advance(0.5)
    assert legs.body_height == pytest.approx(0.25, abs=0.01)
    assert dog.robot[Imu].reading.angular_velocity.y == pytest.approx(-0.3, abs=0.05)
    await dog.clock.advance(0.6)
    assert action.status is ActionStatus.SUCCEEDED
    assert legs.body_height == pytest.approx(0.28, abs=0.005)
    assert legs.attitude == Orientation(0.2, -0.3, 0.1)
    reading = dog.robot[Imu].reading
    assert (reading.orientation.roll, reading.orientation.pitch) == pytest.approx((0.2, -0.3), abs=0.01)
    # Nose up: gravity's reaction points partly ahead; rolled to the right: partly to the left.
    felt = reading.linear_acceleration
    assert felt.x == pytest.approx(9.81 * math.sin(0.3), abs=0.3)
    assert felt.y == pytest.approx(9.81 * math.cos(0.3) * math.sin(0.2), abs=0.3)
    assert abs(dog.robot[Odometry].reading.pose.yaw) < 0.01  # the feet did not turn
    legs.stand()
    await dog.clock.advance(2.0)
    assert legs.attitude == Orientation()
    assert legs.body_height == pytest.approx(0.22, abs=0.005)


async def test_relative_poses_add_up_to_the_limits(dog):
    legs = dog.robot[Legs]
    for _ in range(3):
        legs.hold(BodyPose(0.05, Orientation(pitch=0.2), Point(0.02)), duration=0.5, relative=True)
        await dog.clock.advance(0.6)
    assert legs.attitude.pitch == legs.limits.angle == 0.45
    assert legs.body_height == pytest.approx(legs.limits.highest, abs=0.005)


@pytest.mark.parametrize(
    "body",
    [
        BodyPose(0.31),
        BodyPose(0.09),
        BodyPose(attitude=Orientation(roll=0.46)),
        BodyPose(shift=Point(0.2, 0.0)),
        BodyPose(attitude=Orientation(yaw=math.nan)),
    ],
)
def test_beyond_the_limits(dog, body):
    with pytest.raises(InvalidGoal):
        dog.robot[Legs].hold(body)


async def test_holds_its_pose_while_walking_but_not_lying(dog):
    legs = dog.robot[Legs]
    legs.hold(BodyPose(attitude=Orientation(pitch=0.3)), duration=0.4)
    dog.robot[Base].set_velocity(Twist(0.4))
    await dog.clock.advance(2.0)
    assert legs.attitude.pitch == pytest.approx(0.3)
    assert dog.pose.x > 2.6
    dog.robot[Base].set_velocity(STILL)
    legs.lie_down()
    await dog.clock.advance(3.0)
    assert (legs.posture, legs.attitude) == (Posture.LYING, Orientation())
    refused = legs.hold(BodyPose(0.2))
    await dog.clock.advance(0.1)
    assert isinstance(refused.error, Refused)


@pytest.mark.parametrize(
    "gait", [pytest.param(one, marks=[pytest.mark.slow] if n % 3 else []) for n, one in enumerate(Gait)]
)
async def test_a_gait_cuts_velocities_axis_by_axis(dog, gait):
    spec, base = GAITS[gait], dog.robot[Base]
    dog.robot[Legs].walk(gait)
    base.set_velocity(Twist(1.2, 0.0, 0.0))
    await dog.clock.advance(1.0)
    assert base.velocity.x == pytest.approx(min(1.2, spec.highest.x))
    dog.robot[Legs].walk(gait)
    base.set_velocity(Twist(-0.5, 0.0, 0.0))
    await dog.clock.advance(1.5)
    assert base.velocity.x == pytest.approx(max(-0.5, spec.lowest.x))


async def test_its_own_gait_comes_back_after_standing(dog):
    legs = dog.robot[Legs]
    assert legs.gait is Gait.TROT_ADAPTIVE
    legs.walk(Gait.PRONK, FootLift(0.08, 0.08))
    await dog.clock.advance(0.5)
    assert (legs.gait, legs.foot_lift) == (Gait.PRONK, FootLift(0.08, 0.08))
    await dog.clock.advance(0.7)
    assert (legs.gait, legs.foot_lift) == (Gait.TROT_ADAPTIVE, FootLift())


async def test_a_bound_rocks_and_a_pronk_bounces(dog):
    legs, imu = dog.robot[Legs], dog.robot[Imu]

    async def swings(gait):
        legs.walk(gait)
        dog.robot[Base].set_velocity(Twist(0.2))
        heights, pitches = [], []
        for _ in range(100):
            await dog.clock.advance(0.02)
            heights.append(legs.body_height)
            pitches.append(imu.reading.orientation.pitch)
        return max(heights) - min(heights), max(pitches) - min(pitches)

    trot, bound, pronk = await swings(Gait.TROT_SLOW), await swings(Gait.BOUND), await swings(Gait.PRONK)
    assert bound[1] == pytest.approx(0.24, abs=0.02)
    assert trot[1] < 0.01 > pronk[1]
    assert pronk[0] > 0.04 > trot[0] > 0.002


@pytest.mark.parametrize(("lift", "passes"), [(0.03, False), (0.06, True)])
async def test_feet_step_over_obstacles_below_their_lift(dog, lift, passes):
    dog.world.stage.add_obstacle(Pose(3.0, 5.0), (0.05, 1.0, 0.05))
    dog.robot[Legs].walk(Gait.TROT_SLOW, FootLift(lift, lift))
    dog.robot[Base].set_velocity(Twist(0.5))
    await dog.clock.advance(4.0)
    assert (dog.pose.x > 3.5) is passes


@pytest.mark.parametrize(("lift", "passes"), [(0.03, False), (0.06, True)])
async def test_dance_steps_over_obstacles_below_its_feet(dog, lift, passes):
    dog.world.stage.add_obstacle(Pose(3.0, 5.0), (0.05, 1.0, 0.05))
    steps = [Step(5.0, Twist(0.4), lift=FootLift(lift, 0.08))]
    action = dog.robot[Legs].dance(steps)
    await dog.clock.advance(8.0)
    assert (dog.pose.x > 3.5) is passes
    assert action.status is (ActionStatus.SUCCEEDED if passes else ActionStatus.ABORTED)
    with pytest.raises(InvalidGoal):
        dog.robot[Legs].dance([Step(1.0, lift=FootLift(0.5))])


async def test_high_steps_cost_more(dog):
    async def drawn(lift):
        dog.robot[Legs].walk(Gait.TROT_SLOW, FootLift(lift, lift))
        dog.robot[Base].set_velocity(Twist(0.2, 0.0, 0.5))
        await dog.clock.advance(1.5)
        return -dog.robot[Battery].state.current

    assert await drawn(0.1) > await drawn(0.01) + 0.5


def test_lifts_have_limits(dog):
    for lift in (0.001, 0.2, math.nan):
        with pytest.raises(InvalidGoal):
            dog.robot[Legs].walk(Gait.TROT_SLOW, FootLift(lift, 0.03))


async def test_the_camera_looks_where_the_body_points(dog):
    camera, legs = dog.robot[Camera], dog.robot[Legs]
    before = camera.mount
    legs.hold(BodyPose(attitude=Orientation(pitch=-0.3, yaw=0.2), shift=Point(0.05)), duration=0.2)
    await dog.clock.advance(0.5)
    after = camera.mount
    assert (after.pitch, after.yaw) == pytest.approx((before.pitch - 0.3, 0.2))
    assert after.z - before.z == pytest.approx(0.25 * math.sin(0.3) - 0.12 * (1 - math.cos(0.3)), abs=0.005)
    assert after.y == pytest.approx(math.sin(0.2) * (0.25 * math.cos(0.3) - 0.12 * math.sin(0.3)), abs=0.005)
