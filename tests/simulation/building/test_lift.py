"""The lift: calls, doors, riding, failures, and the robot's radio to it."""

import math
from itertools import pairwise

import pytest

from roboglot.model.components.logistics.lift_client import LiftClient, LiftDoor
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.events import LiftArrived, LiftCalled, LiftDoorClosed, LiftDoorOpened, LiftFailed
from roboglot.model.geometry import STILL, Pose, Twist

EVENTS = (LiftCalled, LiftArrived, LiftDoorClosed, LiftDoorOpened, LiftFailed)
BEFORE = Pose(2.55, 9.95, math.pi)  # in front of the lift's door, facing it
WITHIN = Pose(0.95, 10.0, 0.0)


def start(simulate, pose, floor=0, robots=("a",)):
    sim = simulate("office", start=pose, floor=floor, robots=robots, body="hermes")
    sim.world.start()
    return sim, sim.robot[LiftClient], sim.robot.events.subscribe(*EVENTS)


def reported(heard):
    return [(type(event).__name__, getattr(event, "floor", None)) for event in heard.drain()]


async def drive(sim, speed, seconds):
    sim.robot[Base].set_velocity(Twist(speed))
    await sim.clock.advance(seconds)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)


async def test_robot_rides_to_second_floor_and_drives_out(simulate):
    sim, lift, heard = start(simulate, BEFORE)
    await drive(sim, 0.5, 3.3)
    assert sim.pose.distance_to(WITHIN) < 0.1
    assert lift.state.load == pytest.approx(55 / 630, rel=0.05)
    lift.call(2)
    heights = []
    while not heard.drain() or lift.state.floor != 2 or lift.state.door is not LiftDoor.OPEN:
        await sim.clock.advance(0.1)
        heights.append(sim.world._physics.hulls["a"].elevation)
        assert sim.clock.time() < 30
        assert not sim.robot[Cliff].detected  # the car's floor is a floor
    assert sim.world.truth.floor_of("a") == 2
    assert max(abs(a - b) for a, b in pairwise(heights)) < 0.12  # no jump
    await drive(sim, -0.5, 4.0)  # in reverse, the way it came
    assert sim.pose.x > 2.0
    assert sim.world.truth.floor_of("a") == 2
    await sim.clock.advance(0.2)
    assert sim.robot[Lidar].scan is not None


async def test_lift_reports_its_moves_in_order(simulate):
    sim, lift, heard = start(simulate, BEFORE, floor=1)
    lift.call(1)
    assert reported(heard) == [("LiftCalled", 1)]
    await sim.clock.advance(15.0)
    assert reported(heard) == [("LiftDoorClosed", 0), ("LiftArrived", 1), ("LiftDoorOpened", 1)]
    assert lift.floors == ("ground", "first", "second")
    lift.call(1)
    await sim.clock.advance(0.1)
    assert reported(heard) == [("LiftCalled", 1), ("LiftArrived", 1)]  # the car has arrived


async def test_shut_landing_door_is_seen_open_one_not(simulate):
    sim, lift, _ = start(simulate, BEFORE, floor=1)
    await sim.clock.advance(0.2)
    assert sim.robot[Lidar].scan.ranges[800] == pytest.approx(2.6 - 1.85, abs=0.05)
    lift.call(1)
    await sim.clock.advance(15.0)
    assert sim.robot[Lidar].scan.ranges[800] == pytest.approx(2.6 - 0.15, abs=0.05)  # the car's back wall


@pytest.mark.slow  # long; in short: test_the_door_can_be_held_and_shut
async def test_door_waits_for_obstructions_and_complains(simulate):
    sim, lift, heard = start(simulate, BEFORE)
    sim.world.stage.place("a", Pose(2.0, 10.0, math.pi))
    lift.call(2)
    await sim.clock.advance(60.0)
    assert lift.state.floor == 0
    assert [event.reason for event in heard.drain() if isinstance(event, LiftFailed)] == ["door blocked"]
    assert lift.state.blocked
    sim.world.stage.place("a", BEFORE)
    await sim.clock.advance(25.0)
    assert (lift.state.floor, lift.state.door, lift.state.blocked) == (2, LiftDoor.OPEN, False)


async def test_the_door_can_be_held_and_shut(simulate):
    sim, lift, _ = start(simulate, BEFORE)
    await sim.clock.advance(0.1)
    lift.hold_door(20.0)
    lift.call(1)
    await sim.clock.advance(19.0)
    assert (lift.state.floor, lift.state.door) == (0, LiftDoor.OPEN)
    lift.close_door()
    await sim.clock.advance(2.5)
    assert lift.state.target == 1
    with pytest.raises(Refused, match="on its way"):
        lift.hold_door(5.0)
    with pytest.raises(InvalidGoal):
        lift.hold_door(1e6)
    with pytest.raises(InvalidGoal):
        lift.call(3)


async def test_out_of_service_refuses_and_drops_calls(simulate):
    sim, lift, heard = start(simulate, BEFORE, floor=1)
    (fault,) = sim.world.faults.inject("lift_out_of_service")
    with pytest.raises(Refused, match="out of service"):
        lift.call(1)
    assert not lift.state.in_service
    sim.world.faults.clear(fault.number)
    lift.call(1)
    await sim.clock.advance(15.0)
    assert ("LiftDoorOpened", 1) in reported(heard)


async def test_people_ride_along_too_many_keep_it_waiting(simulate):
    sim, lift, heard = start(simulate, BEFORE)
    (fault,) = sim.world.faults.inject("lift_occupied", people=3)
    await sim.clock.advance(0.2)
    assert lift.state.load == pytest.approx(3 * 75 / 630)
    assert sim.robot[Lidar].scan.ranges[700:900].min() < 1.9  # a person stands in it
    lift.call(1)
    await sim.clock.advance(15.0)
    assert [solid.kind for solid in sim.world._physics.props.on(1)].count("person") == 3
    sim.world.faults.clear(fault.number)
    assert lift.state.load == 0.0
    assert not [event for event in heard.drain() if isinstance(event, LiftFailed)]


async def test_out_of_reach_the_radio_is_silent(simulate):
    sim, lift, heard = start(simulate, BEFORE)
    sim.world.faults.inject("wifi_loss", "a")
    await sim.clock.advance(1.5)
    with pytest.raises(Refused, match="out of reach"):
        lift.call(2)
    sim.world.building.lift.call(2)  # a person presses the button
    await sim.clock.advance(20.0)
    assert lift.state.floor == 0  # the last call received
    assert not reported(heard)


async def test_open_shaft_stops_the_robot_before_it_falls(simulate):
    sim, lift, _ = start(simulate, BEFORE)
    lift.call(2)
    await sim.clock.advance(20.0)
    for half in range(2):  # a person forces the landing door
        sim.world._physics.props.remove(f"landing door 0 {half}")
    sim.robot[Base].set_velocity(Twist(0.7))
    await sim.clock.advance(4.0)
    assert "front" in sim.robot[Cliff].detected
    assert sim.pose.x > 1.75 + 0.2
    sim.robot[Base].set_velocity(Twist(-0.3))
    await sim.clock.advance(2.0)
    assert not sim.robot[Cliff].detected
    assert sim.pose.x > 2.3
