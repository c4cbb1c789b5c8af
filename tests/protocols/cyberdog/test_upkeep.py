"""Chapters "low power", "ota", "developer", "calibration" on a simulated dog."""

from __future__ import annotations

from typing import Any, ClassVar

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.system.developer import Developer
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage, FirmwareState
from roboglot.model.components.system.network import Network
from roboglot.model.components.system.settings import Settings
from roboglot.model.components.system.system_log import SystemLog
from roboglot.model.events import FirmwareChanged, Rebooted, Rebooting, ShuttingDown
from roboglot.model.geometry import Pose
from roboglot.protocols.cyberdog.chapters.system.updates import Updates
from roboglot.protocols.cyberdog.config import CyberDogConfig
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.protocols.cyberdog.table import Push
from roboglot.simulation.components.system.firmware import SimulatedFirmware
from tests.protocols.cyberdog.phone import ADDRESS, App, answered, until

pytestmark = pytest.mark.world("playground", body="cyberdog2")
MD5 = "0123456789abcdef0123456789abcdef"
FILE = {"version": "1.3.2.0", "type": "FULL_PACKAGE", "md5": MD5, "fileSize": 100_000_000, "fileName": "dog.zip"}


def module(**changes: object) -> dict[str, object]:
    """Return an update as the app describes it; ``changes`` of its package."""
    package = {**FILE, **changes}
    return {
        "product": "l91",
        "device": "l91.NX",
        "module": "l91.NX.OTA",
        "current": {"version": None},
        "latest": {"version": "1.3.2.0", "packages": [package], "forceUpdateFlag": False},
    }


MODULE = module()


async def test_low_power_is_left_on_request(client, robot, forward) -> None:
    robot[Power].save()
    await forward(seconds=8)
    assert robot[Power].mode is PowerMode.LOW_POWER
    assert (await client.ask(10001))["state_switch_status"]["state"] == 2
    assert (await client.ask(1004, {"motion_id": 141}))["code"] == 3003
    assert await client.ask(6004, {"type": 7}) == {"accepted": 2}
    assert await answered(client, 10002, {}, forward) == {"success": True}
    assert robot[Power].mode is PowerMode.AWAKE
    assert (await client.ask(10001))["state_switch_status"]["state"] == 0


async def test_an_empty_battery_keeps_it_in_low_power(client, robot, forward) -> None:
    robot[Battery].set_charge(0.03)
    assert await answered(client, 10002, {}, forward) == {"success": False}


@pytest.mark.slow
async def test_lying_leads_to_low_power_if_enabled(client, app, robot, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)  # the first app makes the dog stand up
    robot[Legs].lie_down()
    await forward(seconds=40)
    assert robot[Power].mode is PowerMode.AWAKE
    assert await client.ask(10003, {"data": True}) == {"success": True}
    assert (await client.ask(1001, {"is_lowpower_control": True}))["lowpower_control"] is True
    await forward(seconds=40)
    assert robot[Power].mode is PowerMode.LOW_POWER
    assert await client.ask(10003) == {"error_code": 323}


async def test_calibration_releases_motors_and_powers_them_again(client, robot, forward, world) -> None:
    world.stage.place("a", Pose(4.0, 2.5))
    assert await answered(client, 12001, {"data": False}, forward) == {"success": True, "message": ""}
    assert robot[Legs].posture is Posture.LIMP
    assert await answered(client, 12001, {"data": True}, forward) == {"success": True, "message": ""}
    assert robot[Legs].posture is Posture.STANDING


@pytest.mark.slow
async def test_a_reboot_comes_after_the_answer(client, robot, forward) -> None:
    events: list[Any] = []
    for kind in (Rebooting, Rebooted):
        robot.events.listen(kind, events.append)
    assert await client.ask(9031, {"SystemRestart": "1997"}) == {"result": 0, "reboot_result": 0}
    assert events == []
    await forward(seconds=1.5)
    assert isinstance(events[0], Rebooting)
    await forward(seconds=40)
    assert isinstance(events[-1], Rebooted)


async def test_it_switches_off_after_the_answer(client, robot, forward) -> None:
    events: list[Any] = []
    robot.events.listen(ShuttingDown, events.append)
    assert await client.ask(10006) == {"success": True}
    await forward(seconds=1.5)
    assert events
    assert robot[Power].mode is PowerMode.OFF
    assert (await client.ask(10001))["state_switch_status"]["state"] == 4


@pytest.mark.slow  # in short: test_update_as_in_the_manual_is_downloaded
async def test_an_update_from_download_to_reboot(client, app: App, robot, data, passing, forward, door) -> None:
    assert await client.ask(5001) == {"status": "idle", "code": 0}
    await passing(lambda: app.connected)
    assert await client.ask(5006) == {"time": -2}
    assert (await client.ask(5004, {"md5": MD5}))["code"] == 5703  # nothing was downloaded
    assert await client.ask(5003, {"modules": [MODULE]}) == {"response": True, "code": 0}
    await forward(seconds=2.5)
    assert (await client.ask(5001))["status"] == "download"
    assert 40 <= (await client.ask(5005))["download_progress"] <= 60
    assert (await client.ask(5003, {"modules": [MODULE]})) == {"response": False, "code": 5711}
    assert 5 < (await client.ask(5006))["time"] < 20
    await forward(seconds=3)
    assert await client.ask(5005) == {"download_progress": 100, "upgrade_progress": 0, "code": 0}
    assert (await client.ask(5004, {"md5": "f" * 32}))["code"] == 5710
    assert await client.ask(5004, {"md5": MD5.upper()}) == {"reponse": True, "response": True, "code": 0}
    await forward(seconds=2)
    assert (await client.ask(5001))["status"] == "update"
    assert (await client.ask(10001))["state_switch_status"]["state"] == 3
    assert (await client.ask(1004, {"motion_id": 141}))["code"] == 3003
    await passing(lambda: app.of(5007))
    assert app.of(5007) == [{}]
    assert {"upgrade_progress", "download_progress", "code"} == app.of(5005)[-1].keys()
    assert [push["status"] for push in app.of(5001)] == ["download", "idle", "update"]
    assert app.of(5008) == []
    await forward(seconds=60)
    assert robot[Firmware].version == "1.3.2.0"
    assert (await client.ask(1001, {"is_version": True}))["version"]["new_version"] == "1.3.2.0"
    await door.close()  # as the runtime does at a reboot
    again = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app=f"127.0.0.1:{app.port}"), data)
    await again.start()
    try:
        await passing(lambda: app.of(5008))
        assert app.of(5008) == [{"success": True, "code": 0}]
    finally:
        await again.close()


async def test_fetched_and_installed_update_survives_a_crash(client, robot, forward) -> None:
    """Restart a killed program: a new component over the same settings."""

    def next_life() -> SimulatedFirmware:
        robot[Disk].release("firmware package")
        return SimulatedFirmware(robot[Firmware]._section, robot, robot[Firmware]._base)

    await client.ask(5003, {"modules": [MODULE]})
    await forward(seconds=6)
    left = next_life()
    assert left.progress == robot[Firmware].progress
    assert left.progress.state is FirmwareState.DOWNLOADED
    assert "firmware package" in robot[Disk].uses
    assert left.version == "1.3.0.0"
    installing = left.install(MD5)
    await forward(seconds=12)
    assert installing.status.ended
    assert left.version == "1.3.0.0"  # it runs after a restart
    booted = next_life()
    assert booted.version == "1.3.2.0"
    assert booted.progress.state is FirmwareState.IDLE
    assert "firmware package" not in robot[Disk].uses


async def test_update_as_in_the_manual_is_downloaded(client, robot, passing) -> None:
    example = module(md5="b7e2a750b0", fileSize=0, description=None)
    assert await client.ask(5003, {"modules": [example]}) == {"response": True, "code": 0}
    await passing(lambda: robot[Firmware].progress.state is FirmwareState.DOWNLOADED)


async def test_an_update_that_cannot_be(client, app, robot, passing, forward) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    assert await client.ask(5003, {"modules": [{"module": "x"}]}) == {"error_code": 323}
    broken = module(md5="short")
    assert await client.ask(5003, {"modules": [broken]}) == {"response": False, "code": 5710}
    assert await client.ask(5003, {"modules": [module(fileSize=-1)]}) == {"response": False, "code": 5710}
    robot[Disk].rubbish = robot[Disk].free - 1000
    assert await client.ask(5003, {"modules": MODULE}) == {"response": True, "code": 0}
    await passing(lambda: any(push["download_progress"] == -2 for push in app.of(5005)))
    assert (await client.ask(5005))["download_progress"] == -2


async def test_a_low_battery_installs_nothing(client, app, robot, passing, forward) -> None:
    await client.ask(5003, {"modules": [MODULE]})
    await passing(lambda: app.connected)
    await forward(seconds=6)
    robot[Battery].set_charge(0.1)
    assert (await client.ask(5004, {"md5": MD5}))["code"] == 0
    await passing(lambda: app.of(5008))
    assert app.of(5008) == [{"success": False, "code": 5701}]
    assert app.of(5007) == []
    await until(lambda: app.of(5005))


async def test_developers_access_opens_with_robot_s_own_key(client, robot, forward) -> None:
    serial = robot.description.serial
    for link, result in (("", 1), ("ftp://x/y", 1), ("https://keys.example/another", 2)):
        assert await answered(client, 9030, {"httplink": link}, forward) == {"result": result, "unlock_result": result}
    assert not robot[Developer].unlocked
    answer = await answered(client, 9030, {"httplink": f"https://keys.example/{serial}"}, forward)
    assert answer == {"result": 0, "unlock_result": 0}
    assert robot[Developer].unlocked


async def test_the_environment_is_kept(client, robot) -> None:
    assert (await client.ask(10004, {"data": "moon"}))["success"] is False
    assert await client.ask(10004, {}) == {"error_code": 323}
    assert await client.ask(10004, {"data": "test"}) == {"success": True, "message": ""}
    assert robot[Settings].get("cyberdog.environment", None) == "test"


async def test_log_reaches_maker_unless_there_is_no_internet(client, robot, forward) -> None:
    assert await answered(client, 10005, {}, forward) == {"success": True}
    assert len(robot[SystemLog].uploads) == 1
    await robot[Network].switch_off()
    await forward(seconds=10)
    assert await answered(client, 10005, {}, forward) == {"success": False}


async def test_codes_that_the_text_leaves_out(client, robot, forward) -> None:
    assert await client.ask(5002) == {"version": robot[Firmware].version, "code": 0}
    assert await answered(client, 10007, {}, forward) == {"success": True, "message": ""}
    assert len(robot[SystemLog].uploads) == 1
    assert await client.ask(6012, {"data": True}) == {"error_code": 322}  # this body has no depth camera


@pytest.mark.world("empty", body="universal")
async def test_the_depth_camera_is_switched(client, robot) -> None:
    assert await client.ask(6013) == {"success": True, "message": ""}
    assert await client.ask(6012, {"data": False}) == {"success": True, "message": ""}
    assert not robot[DepthCamera].enabled
    assert await client.ask(6013) == {"success": False, "message": ""}
    assert await client.ask(6012, {}) == {"error_code": 323}


async def test_progress_is_pushed_ten_times_second_at_most(robot, forward) -> None:
    reported: list[float] = []

    class Phone:
        on_found: ClassVar[list[Any]] = []

        def push(self, push: Push, _: object) -> None:
            reported.extend([robot.clock.time()] if push.code == 5005 else [])

    updates = Updates(robot, Phone())  # type: ignore[arg-type]
    firmware = robot[Firmware]
    updates.download(FirmwarePackage("1.3.2.0", 100_000_000, MD5, url="app"), frozenset({MD5}))
    await forward(seconds=1)
    before = len(reported)
    for _ in range(50):  # the most often that a real robot reports
        robot.events.publish(FirmwareChanged(stamp=robot.clock.time(), progress=firmware.progress))
        await forward(seconds=0.02)
    assert 5 <= len(reported) - before <= 11
    updates.close()


async def test_last_app_is_dialled_again_after_a_restart(client, door, app, robot, data, passing) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected and robot[Settings].get("cyberdog.app"))
    await door.close()
    app.ticks.clear()
    again = CyberDogDoor(robot, ADDRESS, CyberDogConfig(port=0, app_port=app.port), data)
    await again.start()
    await passing(lambda: app.ticks)  # not requested
    await again.close()


async def test_forgotten_app_is_not_dialled_after_a_restart(client, app, robot, passing) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected and robot[Settings].get("cyberdog.app"))
    await client.ask(55001)
    await until(lambda: not robot[Settings].get("cyberdog.app"))
