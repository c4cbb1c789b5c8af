"""Chapter "bluetooth": the bracelet of the office, its update, its gear."""

from __future__ import annotations

import asyncio
from itertools import groupby
from typing import Any

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.interaction.remote_control import Gear, RemoteControl
from roboglot.model.components.system.bluetooth import BLUETOOTH, Bluetooth
from roboglot.model.components.system.system_log import SYSTEM_LOG
from roboglot.model.geometry import Point, Pose
from tests.protocols.cyberdog.phone import App, Client, Stream, answered, until

pytestmark = pytest.mark.world("office", body="cyberdog2")
BRACELET, HEADPHONES = "C4:7C:8D:00:00:01", "11:22:33:44:55:66"
WANTED = {"mac": BRACELET, "addr_type": "random", "name": "Bracelet"}
NO_OBJECTS = ("[]", '" "', "7", "null", f'[{{"mac": "{HEADPHONES}"}}]')


@pytest.fixture
def gadget(world):
    """A device beside the robot."""
    world.stage.place("a", Pose(9.0, 6.0))
    gadget = world.gadgets.get(BRACELET)
    gadget.wearer, gadget.place = None, Point(9.5, 6.5)
    return gadget


async def connect(client: Client, forward: Any) -> None:
    assert await answered(client, 8002, {"selected_device": WANTED}, forward) == {"result": 0}


async def test_full_disk_leaves_connection_and_history(client, world, robot, gadget, forward) -> None:
    await connect(client, forward)
    assert await client.ask(8002) == {"result": 0}
    history = robot[Bluetooth].history
    (fault,) = world.faults.inject("full_disk", "a")
    world.stage.place("a", Pose(9.0, 6.2))
    assert await answered(client, 8002, {"selected_device": WANTED}, forward) == {"result": 1}
    assert (robot[Bluetooth].connected, robot[Bluetooth].history) == (None, history)
    assert await client.ask(8007, {"mac": BRACELET}) == {"success": True}  # deleting is possible
    assert robot[Bluetooth].history == ()
    world.faults.clear(fault.number)
    assert await answered(client, 8002, {"selected_device": WANTED}, forward) == {"result": 0}


async def test_scan_connect_and_history(client, robot, gadget, forward) -> None:
    assert await client.ask(8001, {"scan_seconds": 0}) == {"device_info_list": []}
    found = (await answered(client, 8001, {"scan_seconds": 3}, forward))["device_info_list"]
    assert {device["mac"] for device in found} >= {BRACELET, HEADPHONES}
    bracelet = next(device for device in found if device["mac"] == BRACELET)
    assert (bracelet["addr_type"], bracelet["device_type"], bracelet["firmware_version"]) == ("random", 0, "")
    assert await client.ask(8004) == {"device_info_list": []}
    await connect(client, forward)
    (device,) = (await client.ask(8004))["device_info_list"]
    assert (device["mac"], device["device_type"], device["firmware_version"]) == (BRACELET, 16, "1.0.3")
    assert 0 < device["battery_level"] <= 1
    assert await client.ask(8005) == {"success": True, "message": "1.0.3"}
    assert (await client.ask(8006)) == {"connected": True, "persentage": device["battery_level"]}
    assert await client.ask(8001, {}) == {"device_info_list": []}  # the history omits the connected one
    again = (await client.ask(8001, {"scan_seconds": 3}))["device_info_list"]  # at once, without a scan
    assert {device["mac"] for device in again} == {device["mac"] for device in found}, "the last scan's list"
    for wrong in (*NO_OBJECTS, {"device": found[0]}):
        assert await client.ask(8002, wrong) == {"error_code": 323}
    assert robot[Bluetooth].connected is not None
    assert await client.ask(8002) == {"result": 0}
    assert robot[Bluetooth].connected is None
    assert await client.ask(8002) == {"result": 3}
    assert await client.ask(8005) == {"success": False, "message": ""}
    assert await client.ask(8006) == {"connected": False, "persentage": 0.0}
    assert [d["mac"] for d in (await client.ask(8001, {}))["device_info_list"]] == [BRACELET]
    assert await client.ask(8007, {"mac": HEADPHONES}) == {"success": False}
    for not_said in ({"mac": 7}, {"address": HEADPHONES}, *NO_OBJECTS):
        assert await client.ask(8007, not_said) == {"error_code": 323}
    assert [device.address for device in robot[Bluetooth].history] == [BRACELET], "nothing is forgotten"
    assert await client.ask(8007, {"mac": BRACELET}) == {"success": True}
    assert await client.ask(8001, {}) == {"device_info_list": []}


async def test_scan_ends_with_the_last_who_waits(client, door, robot, gadget, forward) -> None:
    first, second = (Stream(client, 8001, {"scan_seconds": 50}) for _ in range(2))
    await until(lambda: robot.actions.running(BLUETOOTH))
    (scan,) = robot.actions.running(BLUETOOTH)
    waiting = door._context.bracelet._waiting
    await until(lambda: waiting[scan.id] == 2)
    first.call.cancel()
    await until(lambda: waiting[scan.id] == 1)
    assert not scan.status.ended
    second.call.cancel()
    await until(lambda: scan.status.ended)
    assert not waiting
    found = await answered(client, 8001, {"scan_seconds": 3}, forward)
    assert found["device_info_list"], "the radio is free for the next scan"


@pytest.mark.parametrize(
    ("code", "asked", "held"), [(8002, {"selected_device": WANTED}, BLUETOOTH), (10005, {}, SYSTEM_LOG)]
)
async def test_work_ends_with_its_only_waiting_app(client, robot, gadget, code, asked, held) -> None:
    """A device was connected, and the log sent, seconds after the app had gone."""
    stream = Stream(client, code, asked)
    await until(lambda: robot.actions.running(held))
    (work,) = robot.actions.running(held)
    stream.call.cancel()
    await until(lambda: work.status is ActionStatus.CANCELED)
    assert work.reason == "no app waits for it any more"


async def test_absent_devices_cannot_be_connected(client, robot, gadget, forward) -> None:
    gadget.on = False
    assert await answered(client, 8002, {"selected_device": WANTED}, forward) == {"result": 1}
    assert await client.ask(8002, {"selected_device": {"mac": BRACELET}}) == {"error_code": 323}
    assert await client.ask(8009) == {"success": False, "message": "no device is connected"}


@pytest.mark.slow  # in short: test_a_device_lost_during_its_update
async def test_lost_and_found_and_its_update(client, app: App, robot, gadget, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await connect(client, forward)
    await passing(lambda: app.of(8008))
    assert app.of(8008) == [{"data": "1.0.3 1.1.0"}]
    gadget.on = False
    await passing(lambda: app.of(8003))
    gadget.on = True
    await passing(lambda: len(app.of(8003)) == 2)
    assert app.of(8003) == [{"disconnected": True}, {"disconnected": False}]
    assert await client.ask(8009) == {"success": True, "message": ""}
    await passing(lambda: app.of(8010) and app.of(8010)[-1]["status"] == 1)
    shares = [push["progress"] for push in app.of(8010)]
    assert shares == sorted(shares)
    assert shares[-1] == 1.0
    assert [status for status, _ in groupby(push["status"] for push in app.of(8010))] == [0, 3, 5, 7, 9, 1]
    assert await client.ask(8005) == {"success": True, "message": "1.1.0"}
    assert await client.ask(8009) == {"success": False, "message": "there is no newer firmware"}


@pytest.mark.parametrize(("stage", "failed"), [(3, 4), (5, 6), (7, 8), pytest.param(9, 10, marks=pytest.mark.slow)])
async def test_a_device_lost_during_its_update(client, app, gadget, passing, forward, stage, failed) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await connect(client, forward)
    await client.ask(8009)
    await passing(lambda: app.of(8010) and app.of(8010)[-1]["status"] == stage)
    assert (await client.ask(8009))["success"] is False
    gadget.on = False
    await passing(lambda: app.of(8010)[-1]["status"] == failed)
    assert 0 <= app.of(8010)[-1]["progress"] < 1
    assert gadget.firmware == "1.0.3"


async def test_a_flat_device_is_not_updated(client, app, gadget, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await connect(client, forward)
    gadget.battery = 0.2
    await client.ask(8009)
    await passing(lambda: len(app.of(8010)) == 2)
    assert [push["status"] for push in app.of(8010)] == [0, 2]


async def test_the_remote_control_s_gear(client, app, robot, gadget, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    await connect(client, forward)
    assert await client.ask(8013) == {"data": 0}
    assert await client.ask(8011, {"data": 1}) == ""
    assert robot[RemoteControl].gear is Gear.MIDDLE
    assert await client.ask(8013) == {"data": 1}
    assert await client.ask(8011, {"data": 3}) == {"error_code": 323}
    gadget.press_gear()
    await passing(lambda: app.of(8012))
    assert app.of(8012) == [{"data": 2}]
    assert await client.ask(8013) == {"data": 2}


@pytest.mark.slow
async def test_anyone_who_wears_the_bracelet_is_followed(client, robot, world, gadget, passing, forward) -> None:
    none = Stream(client, 6004, {"type": 11})
    await passing(lambda: none.ended)
    assert none.codes == [1000, 1001, 15]
    assert none.answers[-2]["feedback_msg"] == "no tag to follow was heard for 15 s"
    assert none.answers[-1] == {"result": 3}
    await connect(client, forward)
    gadget.place = Point(12.5, 6.0)
    stream = Stream(client, 6004, {"type": 11, "relative_pos": 201, "keep_distance": 1.0})
    await passing(lambda: 10 in stream.codes)
    assert (await client.ask(10001))["task_status"]["task_status"] == 11
    await forward(seconds=8)
    assert 0.6 < world.truth.pose_of("a").distance_to(gadget.place) < 1.8
    stopped = asyncio.ensure_future(client.ask(6009, {"type": 11}))
    await passing(stopped.done)
    await until(lambda: stream.ended)
    assert stream.codes == [1000, 1001, 10]
    assert stream.answers[-1] == {"result": 5}
