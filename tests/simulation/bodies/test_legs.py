"""Standing up, lying down, going limp."""

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.errors import Refused
from roboglot.model.events import PostureChanged
from roboglot.model.geometry import STILL, Pose, Twist


async def test_lies_down_and_stands_up_in_time(simulate):
    sim = simulate(start=Pose(5, 5))
    legs, postures = sim.robot[Legs], sim.robot.events.subscribe(PostureChanged)
    sim.world.start()
    assert legs.posture is Posture.STANDING
    lying = legs.lie_down()
    await sim.clock.advance(0.8)
    assert legs.posture is Posture.CHANGING
    assert 0.08 < legs.body_height < 0.17
    await sim.clock.advance(0.8)
    assert lying.status is ActionStatus.SUCCEEDED
    assert legs.posture is Posture.LYING
    assert legs.body_height == pytest.approx(0.05, abs=0.005)
    legs.stand()
    await sim.clock.advance(1.7)
    assert legs.body_height == pytest.approx(0.20, abs=0.005)
    assert [e.posture for e in postures.drain()] == ["changing", "lying", "changing", "standing"]


async def test_brakes_before_lying_down_and_drives_only_standing(simulate):
    sim = simulate(start=Pose(2, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(1.0)
    sim.robot[Legs].lie_down()
    await sim.clock.advance(0.1)
    assert sim.robot[Legs].posture is Posture.STANDING  # still braking
    await sim.clock.advance(3.0)
    there = sim.pose
    with pytest.raises(Refused):
        sim.robot[Base].set_velocity(Twist(0.5))
    sim.robot[Base].set_velocity(STILL)  # braking is always allowed
    await sim.clock.advance(1.0)
    assert sim.pose.distance_to(there) < 0.001


async def test_reached_posture_is_done_at_once_without_disturbance(simulate):
    sim = simulate(start=Pose(5, 5))
    sim.world.start()
    action = sim.robot[Legs].stand()
    await sim.clock.advance(0.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert "base" not in action.resources


async def test_limp_legs_sink_and_only_standing_up_helps(simulate):
    sim = simulate(start=Pose(2, 5))
    legs = sim.robot[Legs]
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(1.0)
    legs.go_limp()
    assert legs.posture is Posture.LIMP
    there = sim.pose
    await sim.clock.advance(1.0)
    assert legs.body_height < 0.06
    assert sim.pose.distance_to(there) < 0.2
    refused = legs.lie_down()
    await sim.clock.advance(0.1)
    assert refused.status is ActionStatus.ABORTED
    legs.stand()
    await sim.clock.advance(2.0)
    assert legs.posture is Posture.STANDING
    assert legs.body_height == pytest.approx(0.20, abs=0.005)
    sim.robot[Base].set_velocity(Twist(0.5))


async def test_cancelled_while_braking_it_can_drive_on(simulate):
    sim = simulate(start=Pose(2, 5))
    sim.world.start()
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(1.0)
    action = sim.robot[Legs].lie_down()
    await sim.clock.advance(0.1)
    action.cancel()
    await sim.clock.advance(0.1)
    assert action.status is ActionStatus.CANCELED
    sim.robot[Base].set_velocity(Twist(0.5))


async def test_cancelled_on_the_way_it_stays_between(simulate):
    sim = simulate(start=Pose(5, 5))
    legs = sim.robot[Legs]
    sim.world.start()
    action = legs.lie_down()
    await sim.clock.advance(0.7)
    action.cancel()
    await sim.clock.advance(0.1)
    height = legs.body_height
    await sim.clock.advance(1.0)
    assert legs.posture is Posture.CHANGING
    assert legs.body_height == pytest.approx(height, abs=0.003)
    with pytest.raises(Refused):
        sim.robot[Base].set_velocity(Twist(0.5))
    legs.stand()
    await sim.clock.advance(2.0)
    assert legs.posture is Posture.STANDING
