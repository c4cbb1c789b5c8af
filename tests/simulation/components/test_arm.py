"""Arm and gripper: reach, ways, and what is really between the jaws."""

import math

import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.arm import Arm, ArmPosition
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.gripper import Gripper, GripperStatus
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import STILL, Pose, Twist

FLOOR = ArmPosition(0.15, -0.05)  # 2 cm above the floor


@pytest.fixture
async def sim(simulate):
    """The can stands 25 cm ahead of the robot: where the arm's end point comes to with FLOOR."""
    sim = simulate("obstacle_course", start=Pose(1.25, 6.0), body="robomaster_ep")
    sim.world.start()
    await sim.clock.advance(0.2)
    return sim


@pytest.fixture
def arm(sim):
    return sim.robot[Arm]


@pytest.fixture
def gripper(sim):
    return sim.robot[Gripper]


async def test_the_arm_moves_straight_and_in_time(sim, arm):
    assert arm.position == arm.home == ArmPosition(0.091, 0.041)
    action = arm.move_to(ArmPosition(0.191, 0.041))
    await sim.clock.advance(0.6)
    assert action.status is ActionStatus.EXECUTING
    assert 0.13 < arm.position.x < 0.15
    assert arm.position.z == pytest.approx(0.041)
    await sim.clock.advance(0.8)
    assert action.status is ActionStatus.SUCCEEDED
    assert arm.position.x == pytest.approx(0.191)
    arm.recenter()
    await sim.clock.advance(2.0)
    assert arm.position == ArmPosition(pytest.approx(0.091), pytest.approx(0.041))


@pytest.mark.parametrize("goal", [(0.05, 0.0), (0.23, 0.0), (0.1, 0.16), (0.1, -0.07), (0.2, 0.14), (math.nan, 0.0)])
async def test_out_of_reach_is_refused_and_nothing_moves(sim, arm, goal):
    with pytest.raises(InvalidGoal):
        arm.move_to(ArmPosition(*goal))
    with pytest.raises(InvalidGoal):
        arm.move_by(ArmPosition(goal[0] - arm.home.x, goal[1] - arm.home.z))
    await sim.clock.advance(0.5)
    assert arm.position == arm.home


async def test_stop_leaves_the_arm_where_it_is(sim, arm):
    action = arm.move_to(ArmPosition(0.2, 0.0))
    await sim.clock.advance(0.5)
    arm.stop()
    there = arm.position
    await sim.clock.advance(1.0)
    assert action.status is ActionStatus.CANCELED
    assert arm.position == there != arm.home


async def close_around_the_can(sim):
    sim.robot[Arm].move_to(FLOOR)
    await sim.clock.advance(2.0)
    sim.robot[Gripper].close(2)
    await sim.clock.advance(2.0)


async def test_closing_on_nothing_closes(sim, gripper):
    assert gripper.status is GripperStatus.OPEN
    action = gripper.close()
    await sim.clock.advance(0.5)
    assert gripper.status is GripperStatus.BETWEEN
    await sim.clock.advance(3.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert gripper.status is GripperStatus.CLOSED
    assert sim.world.truth.held_by("a") is None
    gripper.open()
    await sim.clock.advance(3.0)
    assert gripper.status is GripperStatus.OPEN


async def test_a_higher_level_is_faster(sim, gripper):
    gripper.close(4)
    await sim.clock.advance(0.8)
    assert gripper.status is GripperStatus.CLOSED
    gripper.open(1)
    await sim.clock.advance(0.8)
    assert gripper.status is GripperStatus.BETWEEN


async def test_it_holds_the_can_and_carries_it(sim, arm, gripper):
    await close_around_the_can(sim)
    can = sim.world.truth.thing("can")
    assert sim.world.truth.held_by("a") is can
    assert gripper.status is GripperStatus.BETWEEN
    assert gripper.opening == pytest.approx(can.diameter)
    arm.move_by(ArmPosition(0.0, 0.1))
    await sim.clock.advance(2.0)
    assert can.position[2] == pytest.approx(0.1, abs=0.01)
    sim.robot[Base].set_velocity(Twist(-0.2, 0.0, 0.5))
    await sim.clock.advance(2.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    seen = Pose(*can.position[:2]).relative_to(sim.pose)
    assert (seen.x, seen.y) == (pytest.approx(0.25, abs=0.01), pytest.approx(0.0, abs=0.01))
    gripper.open(4)
    await sim.clock.advance(1.0)
    assert sim.world.truth.held_by("a") is None
    assert can.position[2] == pytest.approx(0.0, abs=0.005)  # it fell


async def test_beside_the_jaws_it_is_not_held(sim, gripper):
    can = sim.world.truth.thing("can")
    can.put(can.position + np.array((0.0, 0.06, 0.0)))
    await close_around_the_can(sim)
    assert sim.world.truth.held_by("a") is None
    assert gripper.status is GripperStatus.CLOSED


async def test_with_the_arm_up_it_is_not_held(sim, arm, gripper):
    arm.move_to(ArmPosition(0.15, 0.05))
    await sim.clock.advance(2.0)
    gripper.close(4)
    await sim.clock.advance(2.0)
    assert gripper.status is GripperStatus.CLOSED


@pytest.mark.parametrize(("level", "held"), [(1, False), (4, True)])
async def test_heavy_things_take_a_firm_grip(sim, arm, gripper, level, held):
    brick, can = sim.world.truth.thing("brick"), sim.world.truth.thing("can")
    brick.put(can.position)
    can.put(can.position + np.array((0.0, 1.0, 0.0)))
    arm.move_to(FLOOR)
    await sim.clock.advance(2.0)
    gripper.close(level)
    await sim.clock.advance(3.0)
    assert gripper.status is GripperStatus.BETWEEN  # the brick is between the jaws in both cases
    arm.move_by(ArmPosition(0.0, 0.1))
    await sim.clock.advance(2.0)
    assert bool(brick.position[2] > 0.09) is held


@pytest.mark.parametrize("level", [0, 5])
async def test_odd_levels_are_refused(gripper, level):
    with pytest.raises(InvalidGoal):
        gripper.close(level)


async def test_things_can_be_pushed(sim, gripper):
    before = sim.world.truth.thing("can").position[0]
    sim.robot[Base].set_velocity(Twist(0.3))
    await sim.clock.advance(2.0)
    assert sim.world.truth.thing("can").position[0] > before + 0.3
    with pytest.raises(NotFound):
        sim.world.truth.thing("spoon")
