"""The delivery robot: drive, cliff sensors, cargo, jack, depth camera, emergency stop and braking, masks."""

import math

import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.logistics.cargo import Cargo, DoorState, Stock
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.motion.base import Base, WheelSpeeds
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.sensor_masks import SensorKind, SensorMasks
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.errors import Blocked, EmergencyStopped, NotFound, Refused
from roboglot.model.events import BoxChanged, CliffDetected, EmergencyStopChanged, ObstacleBraked
from roboglot.model.geometry import STILL, Pose, Twist

HOLES = """
[[floors]]
size = [10, 10]
holes = [{ at = [7.0, 5.0], size = [2.0, 3.0] }]
shelves = [{ at = [2.5, 2.5], clearance = 1.0 }]
access_points = [{ at = [5, 9] }]
"""


@pytest.fixture
def hermes(simulate):
    def build(name="empty", start=None):
        sim = simulate(name, start=start or Pose(3, 5), body="hermes")
        sim.world.start()
        return sim

    return build


@pytest.fixture
def holes(tmp_path):
    path = tmp_path / "holes.toml"
    path.write_text(HOLES)
    return str(path)


async def test_differential_drive_goes_ahead_and_turns_never_sideways(hermes):
    sim = hermes()
    base = sim.robot[Base]
    assert not base.limits.holonomic
    assert base.limits.twist.y == 0.0
    base.set_velocity(Twist(0.0, 0.5))
    await sim.clock.advance(1.0)
    assert base.velocity == STILL
    base.set_velocity(Twist(0.6, 0.4, 0.5))
    await sim.clock.advance(3.0)
    assert (base.velocity.x, base.velocity.y, base.velocity.yaw) == pytest.approx((0.6, 0.0, 0.5))
    wheels = base.wheel_speeds
    assert (wheels.front_left, wheels.front_right) == (wheels.rear_left, wheels.rear_right)
    assert wheels.front_right - wheels.front_left == pytest.approx(0.5 * 0.40 / 0.085)
    base.set_wheel_speeds(WheelSpeeds(-4, 4, -4, 4))
    await sim.clock.advance(2.0)
    assert base.velocity.yaw == pytest.approx(4 * 0.085 / 0.20)
    assert base.velocity.x == pytest.approx(0.0)


async def test_it_stops_before_a_hole_and_turns_away(hermes, holes):
    sim = hermes(holes, Pose(4, 5))
    heard = sim.robot.events.subscribe(CliffDetected)
    sim.robot[Base].set_velocity(Twist(1.0))
    await sim.clock.advance(4.0)
    assert "front" in {event.zone for event in heard.drain()}
    assert sim.pose.x < 6.0 - 0.1
    assert [fault.name for fault in sim.robot[Health].faults] == ["cliff"]
    sim.robot[Base].set_velocity(Twist(0.0, 0.0, 1.0))
    await sim.clock.advance(math.pi)
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(2.0)
    assert sim.pose.x < 5.5
    assert not sim.robot[Health].faults


async def test_falls_without_cliff_sensors_and_stays_there(hermes, holes):
    sim = hermes(holes, Pose(5, 5))
    masks = sim.robot[SensorMasks]
    for sensor in masks.sensors:
        if sensor.kind is SensorKind.CLIFF:
            masks.mask(sensor.id)
    sim.robot[Base].set_velocity(Twist(0.8))
    await sim.clock.advance(5.0)
    assert sim.world._physics.hulls["a"].elevation < -1.0
    assert not sim.robot[Cliff].detected
    assert sim.robot[Health].worst is FaultLevel.FATAL
    with pytest.raises(Refused, match="fell"):
        sim.robot[Base].set_velocity(Twist(0.1))
    sim.world.stage.place("a", Pose(3, 5))
    sim.robot[Base].set_velocity(Twist(0.1))


async def test_emergency_braking_stops_before_an_obstacle(hermes):
    sim = hermes()
    heard = sim.robot.events.subscribe(ObstacleBraked)
    sim.world.stage.add_obstacle(Pose(6, 5), (0.4, 0.4, 1.0))
    sim.robot[Base].set_velocity(Twist(1.2))
    await sim.clock.advance(4.0)
    assert 5.8 - 0.27 - 0.4 < sim.pose.x < 5.8 - 0.27
    assert len(heard.drain()) == 1
    assert not sim.robot[Bumper].pressed
    sim.robot[Base].set_velocity(Twist(-0.5))
    await sim.clock.advance(1.0)
    assert not sim.robot[EmergencyBraking].braking
    sim.robot[EmergencyBraking].enable(False)
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(3.0)
    assert sim.robot[Bumper].pressed == {"front"}


async def test_the_emergency_stop_cancels_and_refuses_until_released(hermes):
    sim = hermes()
    stop, base = sim.robot[EmergencyStop], sim.robot[Base]
    heard = sim.robot.events.subscribe(EmergencyStopChanged)

    async def keep(action):
        while True:
            base.set_velocity(Twist(0.8))
            await sim.clock.sleep(0.02)

    action = sim.robot.actions.start("drive", keep, resources={BASE})
    await sim.clock.advance(2.0)
    before = sim.pose.x
    stop.engage()
    await sim.clock.advance(1.0)
    assert sim.pose.x - before < 0.15
    assert action.status is ActionStatus.CANCELED
    with pytest.raises(EmergencyStopped):
        base.set_velocity(Twist(0.1))
    assert [fault.name for fault in sim.robot[Health].faults] == ["emergency stop"]
    stop.release()
    base.set_velocity(Twist(0.1))
    stop.press(True)
    with pytest.raises(Refused, match="button"):
        stop.release()
    stop.press(False)
    assert [event.engaged for event in heard.drain()] == [True, False, True, False]


async def test_emergency_braking_looks_once_a_scan(hermes):
    sim = hermes(start=Pose(2, 5))
    duty, begun = sim.robot[EmergencyBraking].duty, []
    changed = duty.changed
    duty.changed = lambda on: (begun.append(on), changed(on))
    sim.robot[Base].set_velocity(Twist(0.3))
    await sim.clock.advance(1.0)
    assert sim.robot[Base].velocity == Twist(0.3)
    assert sum(begun) > 15  # while the speed changed
    begun.clear()
    await sim.clock.advance(1.0)
    assert sum(begun) == 10
    assert not duty.on


async def test_with_the_brake_released_people_can_push_it(hermes):
    sim = hermes()
    stop, hull = sim.robot[EmergencyStop], sim.world._physics.hulls["a"]
    hull.push(40.0, 0.0, 0.0)
    await sim.clock.advance(2.0)
    held = sim.pose.x - 3.0
    stop.release_brake(True)
    hull.push(40.0, 0.0, 0.0)
    await sim.clock.advance(1.0)
    assert sim.robot[Base].velocity.x > 0.3  # its wheels notice it
    await sim.clock.advance(1.0)
    assert sim.pose.x - 3.0 - held > 10 * held
    with pytest.raises(EmergencyStopped):
        sim.robot[Base].set_velocity(Twist(0.1))
    stop.release_brake(False)
    await sim.clock.advance(0.5)
    there = sim.pose
    await sim.clock.advance(1.0)
    assert sim.pose.distance_to(there) < 0.01


async def test_a_box_opens_takes_a_parcel_and_locks(hermes):
    sim = hermes()
    cargo = sim.robot[Cargo]
    heard = sim.robot.events.subscribe(BoxChanged)
    assert [compartment.boxes for compartment in cargo.compartments] == [(0, 1), (2, 3)]
    assert cargo.box(1).locked
    with pytest.raises(Refused, match="not open"):
        cargo.put(1, 1.0)
    action = cargo.open_box(1)
    await sim.clock.advance(1.5)
    assert cargo.box(1).door is DoorState.OPENING
    await sim.clock.advance(2.0)
    assert (action.status, cargo.box(1).door, cargo.box(1).locked) == (ActionStatus.SUCCEEDED, DoorState.OPEN, False)
    cargo.put(1, 0.5)
    cargo.close_box(1)
    await sim.clock.advance(3.5)
    assert (cargo.box(1).door, cargo.box(1).locked, cargo.box(1).stock) == (DoorState.CLOSED, True, Stock.PARTLY)
    doors = [event.box.door for event in heard.drain()]
    assert doors == [DoorState.OPENING, DoorState.OPEN, DoorState.OPEN, DoorState.CLOSING, DoorState.CLOSED]
    with pytest.raises(NotFound):
        cargo.open_box(4)


async def test_a_hand_in_the_door_stalls_it(hermes):
    sim = hermes()
    cargo = sim.robot[Cargo]
    cargo.open_box(0)
    await sim.clock.advance(4.0)
    cargo.hold_hand_into(0, True)
    action = cargo.close_box(0)
    await sim.clock.advance(4.0)
    assert isinstance(action.error, Blocked)
    assert cargo.box(0).errors == ("something is in the door",)
    assert not cargo.box(0).locked
    cargo.hold_hand_into(0, False)
    again = cargo.close_box(0)
    await sim.clock.advance(4.0)
    assert (again.status, cargo.box(0).locked, cargo.box(0).errors) == (ActionStatus.SUCCEEDED, True, ())


async def test_the_jack_lifts_a_shelf_and_carries_it(hermes, holes):
    sim = hermes(holes, Pose(2.5, 2.5))
    jack, (shelf,) = sim.robot[Jack], sim.world.building.shelves
    action = jack.raise_platform()
    await sim.clock.advance(2.0)
    assert jack.stage is JackStage.MOVING
    await sim.clock.advance(2.5)
    assert (action.status, jack.stage, jack.loaded) == (ActionStatus.SUCCEEDED, JackStage.UP, True)
    assert shelf.lifted == pytest.approx(0.03)
    sim.robot[EmergencyBraking].enable(False)  # the lidar sees the shelf's own legs
    sim.robot[Base].set_velocity(Twist(0.5))
    await sim.clock.advance(3.0)
    sim.robot[Base].set_velocity(STILL)
    await sim.clock.advance(1.0)
    assert shelf.pose.distance_to(sim.pose) < 0.01
    assert sim.pose.x > 3.5
    jack.lower_platform()
    await sim.clock.advance(4.5)
    assert (jack.stage, jack.loaded, shelf.lifted) == (JackStage.DOWN, False, 0.0)


async def test_a_jammed_jack_raises_an_alarm(hermes):
    sim = hermes()
    jack = sim.robot[Jack]
    (fault,) = sim.world.faults.inject("jack_jammed")
    action = jack.raise_platform()
    await sim.clock.advance(0.2)
    assert isinstance(action.error, Blocked)
    with pytest.raises(Refused, match="alarm"):
        jack.raise_platform()
    assert [f.name for f in sim.robot[Health].faults] == ["jack alarm"]
    sim.world.faults.clear(fault.number)
    jack.clear_alarm()
    jack.raise_platform()
    await sim.clock.advance(5.0)
    assert jack.stage is JackStage.UP


async def test_depth_camera_sees_what_the_lidar_does_not(hermes):
    sim = hermes()
    sim.world.stage.add_obstacle(Pose(4.2, 5.0), (0.3, 0.6, 0.12))  # below the lidar's plane
    await sim.clock.advance(0.2)
    camera = sim.robot[DepthCamera]
    image = camera.image
    assert image.depths.shape == (24, 32)
    on_it = image.points[(np.abs(image.points[:, 0] - 1.05) < 0.05) & (np.abs(image.points[:, 1]) < 0.25)]
    assert len(on_it)
    assert on_it[:, 2].max() == pytest.approx(0.12, abs=0.05)
    floor = image.points[image.points[:, 0] < 0.9]
    assert np.abs(floor[:, 2]).max() < 0.05
    assert camera.image is image  # not more often than its rate
    masks = sim.robot[SensorMasks]
    eye = next(sensor for sensor in masks.sensors if sensor.kind is SensorKind.DEPTH_CAMERA)
    masks.mask(eye.id, always=True)
    assert camera.image is None
    assert masks.masked == {eye.id: True}
    masks.unmask(eye.id)
    camera.enable(False)
    assert camera.image is None
