"""Bluetooth devices come and go with distance and walls; the tag on the wrist is ranged."""

from __future__ import annotations

import math

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.interaction.remote_control import Gear, RemoteControl
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.ultra_wideband import UltraWideband
from roboglot.model.components.system.bluetooth import Bluetooth, DeviceKind, DeviceUpdate, DeviceUpdateStage
from roboglot.model.errors import Blocked, InvalidGoal, NotFound, Refused
from roboglot.model.events import BluetoothConnected, BluetoothLost, GearChanged
from roboglot.model.geometry import STILL, Point, Pose

BRACELET, HEADPHONES = "C4:7C:8D:00:00:01", "11:22:33:44:55:66"


@pytest.fixture
def dog(simulate):
    sim = simulate("yard", start=Pose(10, 8), body="cyberdog2")
    gadget = sim.world.gadgets.get(BRACELET)
    gadget.wearer, gadget.place = None, Point(13, 12)
    sim.world.start()
    return sim


async def connected(dog):
    action = dog.robot[Bluetooth].connect(BRACELET)
    await dog.clock.advance(3.0)
    assert action.status is ActionStatus.SUCCEEDED
    return dog.robot[Bluetooth]


async def test_a_scan_hears_what_is_near(simulate):
    sim = simulate("office", start=Pose(9, 6), body="cyberdog2")
    sim.world.start()
    bluetooth = sim.robot[Bluetooth]
    assert not bluetooth.found
    bluetooth.scan(3.0)
    await sim.clock.advance(2.9)
    assert not bluetooth.found
    await sim.clock.advance(0.2)
    names = [device.name for device in bluetooth.found]
    assert names[0] == "Headphones"  # the nearest
    assert all(device.kind is DeviceKind.UNKNOWN and device.battery is None for device in bluetooth.found)
    sim.world.gadgets.get(HEADPHONES).on = False
    bluetooth.scan(1.0)
    await sim.clock.advance(1.1)
    assert "Headphones" not in [device.name for device in bluetooth.found]
    with pytest.raises(InvalidGoal):
        bluetooth.scan(0.0)


async def test_connects_and_knows_it_then(dog):
    events = dog.robot.events.subscribe(BluetoothConnected)
    bluetooth = await connected(dog)
    device = bluetooth.connected
    assert (device.kind, device.firmware, device.battery) == (DeviceKind.BRACELET, "1.0.3", 0.8)
    assert [event.again for event in events.drain()] == [False]
    assert [known.address for known in bluetooth.history] == [BRACELET]
    await bluetooth.disconnect()
    assert bluetooth.connected is None
    with pytest.raises(Refused):
        await bluetooth.disconnect()
    await bluetooth.forget(BRACELET)
    assert not bluetooth.history
    with pytest.raises(NotFound):
        await bluetooth.forget(BRACELET)
    no_one = bluetooth.connect("00:00:00:00:00:00")
    await dog.clock.advance(3.0)
    assert isinstance(no_one.error, NotFound)


async def test_lost_far_away_and_back_by_itself(dog):
    bluetooth = await connected(dog)
    events = dog.robot.events.subscribe(BluetoothConnected, BluetoothLost)
    gadget = dog.world.gadgets.get(BRACELET)
    gadget.place = Point(400, 12)
    await dog.clock.advance(1.0)
    assert bluetooth.connected is None
    gadget.place = Point(13, 12)
    await dog.clock.advance(1.0)
    assert bluetooth.connected is not None
    lost, again = events.drain()
    assert isinstance(lost, BluetoothLost)
    assert again.again


async def test_updates_the_device(dog):
    bluetooth = await connected(dog)
    assert bluetooth.update_available == "1.1.0"
    action = bluetooth.update_device()
    await dog.clock.advance(10.0)
    assert isinstance(action.feedback, DeviceUpdate)
    assert (action.feedback.stage, action.feedback.share) == (DeviceUpdateStage.SENDING, pytest.approx(0.5, abs=0.05))
    await dog.clock.advance(11.0)
    assert action.status is ActionStatus.SUCCEEDED
    assert (bluetooth.connected.firmware, bluetooth.update_available) == ("1.1.0", "")
    again = bluetooth.update_device()
    await dog.clock.advance(0.1)
    assert isinstance(again.error, Refused)


async def test_an_update_breaks_off_when_the_device_goes(dog):
    bluetooth = await connected(dog)
    action = bluetooth.update_device()
    await dog.clock.advance(5.0)
    dog.world.gadgets.get(BRACELET).on = False
    await dog.clock.advance(1.0)
    assert isinstance(action.error, Blocked)
    dog.world.gadgets.get(BRACELET).on = True
    await dog.clock.advance(1.0)
    assert bluetooth.connected.firmware == "1.0.3"


async def test_the_tag_is_ranged_by_geometry(dog):
    tag = dog.robot[UltraWideband]
    assert tag.tag is None
    await connected(dog)
    reading = tag.tag
    assert reading.distance == pytest.approx(5.0, abs=0.2)
    assert reading.azimuth == pytest.approx(math.atan2(4, 3), abs=0.12)
    assert reading.line_of_sight
    dog.world.gadgets.get(BRACELET).place = Point(16, 8)
    dog.world.stage.place("a", Pose(10, 16, math.pi / 2))  # the wall at x = 12 is in between
    dog.world.gadgets.get(BRACELET).place = Point(16, 16)
    await dog.clock.advance(0.2)
    behind = tag.tag
    assert not behind.line_of_sight
    assert behind.distance == pytest.approx(6.15, abs=0.5)
    assert behind.azimuth == pytest.approx(-math.pi / 2, abs=0.3)
    dog.world.gadgets.get(BRACELET).place = Point(39, 28)
    await dog.clock.advance(0.2)
    assert tag.tag is None  # beyond its range


async def test_the_bracelet_steers_the_robot(fleet, clock):
    """Needs Driving, so with autonomy: a universal robot in the office, the bracelet beside it."""
    robot, world = fleet.robots["a"], fleet.world
    gadget = world.gadgets.get(BRACELET)
    gadget.wearer, gadget.place = None, world.truth.pose_of("a").point
    robot[Bluetooth].connect(BRACELET)
    await clock.advance(3.0)
    remote, gears = robot[RemoteControl], robot.events.subscribe(GearChanged)
    assert remote.gear is Gear.LOW
    before = world.truth.pose_of("a")
    gadget.steer(forward=1.0)
    await clock.advance(2.0)
    assert robot[Base].velocity.x == pytest.approx(0.6)
    gadget.press_gear()
    await clock.advance(1.0)
    assert [event.gear for event in gears.drain()] == [Gear.MIDDLE]
    assert robot[Base].velocity.x == pytest.approx(1.0)
    remote._gear = None  # as after a restart
    assert remote.gear is Gear.MIDDLE
    gadget.steer()
    await clock.advance(1.5)
    assert robot[Base].velocity == STILL
    there = world.truth.pose_of("a")
    assert there.distance_to(before) > 1.5
    gadget.steer(turn=-1.0)
    await clock.advance(1.0)
    gadget.on = False  # the radio goes while the stick is held
    await clock.advance(2.0)
    assert robot[Base].velocity == STILL
    assert world.truth.pose_of("a").relative_to(there).yaw < -0.5
    await remote.set_gear(Gear.HIGH)
    assert remote.gear is Gear.HIGH
    with pytest.raises(ValueError, match="-1 to 1"):
        gadget.steer(forward=2.0)
