"""The gimbal: modes, limits, frames, and what moves it."""

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gimbal import (
    FollowMode,
    Gimbal,
    GimbalAngles,
    GimbalFrame,
)
from roboglot.model.errors import InvalidGoal, Refused, Unreachable
from roboglot.model.geometry import STILL, Pose, Twist

DEG = math.radians(1)


@pytest.fixture
def sim(simulate):
    sim = simulate(start=Pose(5, 5), body="robomaster_ep")
    sim.world.start()
    return sim


@pytest.fixture
def gimbal(sim):
    return sim.robot[Gimbal]


async def test_it_starts_centred_and_follows_the_chassis(gimbal):
    assert gimbal.angles == gimbal.attitude == GimbalAngles()
    assert gimbal.mode is FollowMode.CHASSIS_LEAD
    assert not gimbal.suspended


async def test_a_move_takes_its_time_and_ends_there(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    action = gimbal.move_to(pitch=-20 * DEG, yaw=90 * DEG, pitch_speed=1.0, yaw_speed=1.0)
    await sim.clock.advance(1.0)
    assert gimbal.angles.pitch == pytest.approx(-20 * DEG)
    assert 0.95 < gimbal.angles.yaw < 1.01
    assert action.status is ActionStatus.EXECUTING
    await sim.clock.advance(0.8)
    assert action.status is ActionStatus.SUCCEEDED
    assert gimbal.angles.yaw == pytest.approx(90 * DEG)


async def test_an_axis_that_is_not_named_stays(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    gimbal.move_to(yaw=1.0)
    await sim.clock.advance(1.0)
    gimbal.move_by(pitch=0.1)
    await sim.clock.advance(1.0)
    assert gimbal.angles == GimbalAngles(pytest.approx(0.1), pytest.approx(1.0))
    gimbal.recenter()
    await sim.clock.advance(1.0)
    assert gimbal.angles == GimbalAngles()


@pytest.mark.parametrize(
    "goal", [{"pitch": -36 * DEG}, {"pitch": 21 * DEG}, {"yaw": 251 * DEG}, {"yaw": math.nan}, {"yaw_speed": 0.0}]
)
async def test_out_of_reach_is_refused_and_nothing_moves(sim, gimbal, goal):
    with pytest.raises(InvalidGoal):
        gimbal.move_to(**{"yaw": 0.1, **goal})
    await sim.clock.advance(0.5)
    assert gimbal.angles == GimbalAngles()


async def test_moving_by_stops_at_the_limits(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    action = gimbal.move_by(pitch=-3.0, yaw=-9.0)
    await sim.clock.advance(2.0)
    assert action.status is ActionStatus.ABORTED
    assert "the end of its travel, 265.7 degrees short" in action.reason
    assert gimbal.angles == GimbalAngles(pytest.approx(-35 * DEG, abs=1e-4), pytest.approx(-250 * DEG, abs=1e-4))


async def test_speed_lasts_until_changed(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    turning = gimbal.set_speed(0.0, 0.5, source="me")
    await sim.clock.advance(2.0)
    assert gimbal.angles.yaw == pytest.approx(1.0, abs=0.03)
    assert gimbal.set_speed(0.0, -0.5, source="me") is turning
    await sim.clock.advance(1.0)
    assert gimbal.angles.yaw == pytest.approx(0.5, abs=0.05)
    gimbal.set_speed(0.0, 0.0, source="me")
    await sim.clock.advance(0.2)
    assert turning.status is ActionStatus.SUCCEEDED
    before = gimbal.angles
    await sim.clock.advance(1.0)
    assert gimbal.angles == before


async def test_a_new_command_takes_over(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    first = gimbal.set_speed(0.0, 0.5, source="one")
    await sim.clock.advance(0.5)
    second = gimbal.move_to(yaw=-0.5, source="two")
    await sim.clock.advance(1.0)
    assert (first.status, second.status) == (ActionStatus.CANCELED, ActionStatus.SUCCEEDED)
    assert gimbal.angles.yaw == pytest.approx(-0.5)


async def test_chassis_lead_brings_gimbal_round_with_the_chassis(sim, gimbal):
    sim.robot[Base].set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(2.0)
    assert -0.25 < gimbal.angles.yaw < -0.1  # it lags while the chassis turns left
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(2.0)
    assert gimbal.angles.yaw == 0.0
    assert gimbal.attitude.yaw == pytest.approx(sim.pose.yaw, abs=0.02)


async def test_chassis_lead_knows_no_yaw_commands(sim, gimbal):
    action = gimbal.move_to(pitch=0.1, yaw=1.0)
    await sim.clock.advance(2.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert gimbal.angles == GimbalAngles(pytest.approx(0.1), 0.0)


async def test_free_keeps_the_heading_in_the_world(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    gimbal.move_to(yaw=0.7)
    await sim.clock.advance(1.0)
    sim.robot[Base].set_velocity(Twist(yaw=-0.8))  # only to one side, to show a flipped sign
    await sim.clock.advance(2.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    assert sim.pose.yaw == pytest.approx(-1.6, abs=0.1)
    assert gimbal.angles.yaw + sim.pose.yaw == pytest.approx(0.7, abs=0.01)
    assert gimbal.attitude.yaw == pytest.approx(0.7, abs=0.03)


async def test_gimbal_lead_turns_the_chassis_after_the_gimbal(sim, gimbal):
    gimbal.set_mode(FollowMode.GIMBAL_LEAD)
    gimbal.move_to(yaw=math.pi / 2)
    await sim.clock.advance(4.0)
    assert sim.pose.yaw == pytest.approx(math.pi / 2, abs=0.01)
    assert gimbal.angles.yaw == pytest.approx(0.0, abs=0.01)
    assert sim.robot[Base].velocity == STILL
    sim.robot[Base].set_velocity(Twist(0.5, 0.0, 1.0))  # its own rotation does not count
    await sim.clock.advance(1.0)
    assert sim.pose.yaw == pytest.approx(math.pi / 2, abs=0.02)
    assert sim.pose.y > 5.3


async def test_gimbal_lead_lets_planned_drivers_turn(sim, gimbal):
    gimbal.set_mode(FollowMode.GIMBAL_LEAD)

    async def drive(action):
        sim.robot[Base].set_velocity(Twist(yaw=0.5))
        await sim.clock.sleep(2.0)

    sim.robot.actions.start("navigate", drive, resources={"base"}, goal="kitchen")
    await sim.clock.advance(2.0)
    assert sim.pose.yaw == pytest.approx(1.0, abs=0.05)


async def test_world_frame_goals_count_from_power_on(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    sim.robot[Base].set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(1.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(0.5)
    gimbal.move_to(yaw=0.3, frame=GimbalFrame.WORLD)
    await sim.clock.advance(1.0)
    assert gimbal.attitude.yaw == pytest.approx(0.3, abs=0.005)
    assert gimbal.angles.yaw + sim.pose.yaw == pytest.approx(0.3, abs=0.02)


async def test_goal_in_world_behind_limit_is_given_up(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    action = gimbal.move_to(yaw=300 * DEG, frame=GimbalFrame.WORLD)
    await sim.clock.advance(3.0)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Unreachable)


async def test_suspended_it_has_no_torque(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    moving = gimbal.move_to(yaw=2.0, yaw_speed=0.5)
    await sim.clock.advance(1.0)
    gimbal.suspend()
    await sim.clock.advance(0.1)
    assert moving.status is ActionStatus.CANCELED
    with pytest.raises(Refused):
        gimbal.move_to(yaw=0.0)
    before = gimbal.angles.yaw
    sim.robot[Base].set_velocity(Twist(yaw=1.0))
    await sim.clock.advance(1.0)
    assert gimbal.angles.yaw == before  # it turns with the body instead of holding its heading
    gimbal.resume()
    await sim.clock.advance(0.5)
    assert gimbal.angles.yaw == pytest.approx(before - 0.5, abs=0.03)


@pytest.mark.parametrize("mode", FollowMode)
async def test_held_it_turns_with_the_body(sim, gimbal, mode):
    gimbal.set_mode(FollowMode.FREE)
    gimbal.move_to(pitch=-0.2, yaw=1.0)
    await sim.clock.advance(1.5)
    gimbal.set_mode(mode)
    sim.robot.actuators.hold("the test", "no power")
    before = gimbal.angles
    sim.robot[Base].set_velocity(Twist(yaw=1.0))  # as of free wheels that someone turns
    await sim.clock.advance(1.0)
    assert gimbal.angles == before
    assert gimbal.attitude.yaw == pytest.approx(before.yaw + 1.0, abs=0.15)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(0.5)
    sim.robot.actuators.release("the test")
    await sim.clock.advance(2.0)
    assert gimbal.angles.yaw == pytest.approx(1.0 if mode is FollowMode.FREE else 0.0, abs=0.02)


async def test_it_keeps_its_pitch_to_horizon_on_slope(simulate):
    sim = simulate("obstacle_course", start=Pose(3.7, 4.0), body="robomaster_ep")
    sim.world.start()
    await sim.clock.advance(1.0)
    gimbal = sim.robot[Gimbal]
    assert gimbal.attitude.pitch == pytest.approx(0.0, abs=0.01)
    assert gimbal.angles.pitch == pytest.approx(math.atan(0.4 / 1.5), abs=0.01)  # down, because the body pitches up


async def test_lifted_and_put_elsewhere_gimbal_goes_with_robot(sim, gimbal):
    gimbal.set_mode(FollowMode.FREE)
    sim.world.stage.place("a", Pose(3, 3, 2.0))
    await sim.clock.advance(0.5)
    assert gimbal.angles.yaw == pytest.approx(0.0, abs=1e-6)
