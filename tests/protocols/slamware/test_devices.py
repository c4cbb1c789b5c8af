"""Parameters, health, power, jack, masks, firmware and statistics through a real socket, judged by the robot."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator

import httpx
import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.firmware import Firmware, FirmwarePackage, Module
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.statistics.lifetime_totals import TOTALS
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.storage.database import Database
from roboglot.testing import Forward

pytestmark = pytest.mark.world("empty")
SYSTEM = "/api/core/system/v1"
ACTIONS = "/api/core/motion/v1/actions"
PARAMETER, HEALTH, MASKS = f"{SYSTEM}/parameter", f"{SYSTEM}/robot/health", "/api/core/sensors/v1/masks"


async def put(client: httpx.AsyncClient, name: str, value: str) -> int:
    return (await client.put(PARAMETER, json={"param": name, "value": value})).status_code


async def test_the_machine_is_configured_for_good(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    cube, built = f"{SYSTEM}/cube/config", robot[Base].limits.twist
    config = {"max_moving_speed": 0.4, "disabled_sensors": [1]}
    reply = await client.put(cube, content=json.dumps(config))
    assert (reply.status_code, reply.content) == (200, b"")
    assert robot[Base].limits.twist == Twist(0.4, built.y, built.yaw)
    assert robot[SensorMasks].masked == {1: True}
    await put(client, "base.max_moving_speed", "0.2")
    robot[Firmware].reboot()
    await forward(seconds=40)
    assert robot[Base].limits.twist.x == 0.4
    assert robot[SensorMasks].masked == {1: True}
    for content in (b"\x00CUBE\xff", b"", b"[]", b'{"max_moving_speed": 99}', b'{"wheels": 6}'):
        assert (await client.put(cube, content=content)).status_code == 400
    assert (await client.put(cube, content=b'{"disabled_sensors": [9999]}')).status_code == 404
    assert robot[Base].limits.twist.x == 0.4
    assert (await client.put(cube, content=b"{}")).status_code == 200
    assert robot[Base].limits.twist == built
    assert robot[SensorMasks].masked == {}


async def test_the_emergency_stop_holds_the_robot_and_shows(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    await client.get("/api/platform/v1/events")
    assert await put(client, "base.emergency_stop", "on") == 200
    await forward(seconds=1)
    assert robot[EmergencyStop].engaged
    health = (await client.get(HEALTH)).json()
    assert (health["hasError"], health["hasSystemEmergencyStop"]) == (True, True)
    (record,) = health["baseError"]
    assert (record["errorCode"], record["componentErrorType"]) == (0x02010100, 2049)
    assert {"type": "DEVICE_ERROR"}.items() <= (await client.get("/api/platform/v1/events")).json()[0].items()
    assert (await client.delete(f"{HEALTH}/{record['errorCode']}")).status_code == 200
    assert (await client.get(HEALTH)).json()["baseError"] == []
    unknown = await client.delete(f"{HEALTH}/{record['errorCode']}")
    assert (unknown.status_code, unknown.reason_phrase) == (400, "Invalid Error Code")
    await forward(seconds=11)
    assert len((await client.get(HEALTH)).json()["baseError"]) == 1  # its cause persists
    assert await put(client, "base.emergency_stop", "off") == 200
    await forward(seconds=1)
    assert (await client.get(HEALTH)).json()["baseError"] == []
    assert await put(client, "base.brake_release", "on") == 200
    assert robot[EmergencyStop].brake_released
    assert await put(client, "base.brake_release", "maybe") == 400


async def test_the_jack(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    jack = f"{SYSTEM}/jack/status"
    assert (await client.get(jack)).json() == {"actual_pos": 31, "alarm": 0, "drv_status": 0, "stage": 2}
    assert (await client.post(jack, json="Up")).status_code == 200
    await forward(seconds=0.5)
    moving = (await client.get(jack)).json()
    assert (moving["stage"], moving["drv_status"]) == (3, 1)
    assert (await client.post(jack, json="Stop")).status_code == 200
    await forward(seconds=1)
    assert robot[Jack].stage is JackStage.STOPPED
    await client.post(jack, json="Up")
    await forward(seconds=30)
    assert (await client.get(jack)).json() == {"actual_pos": 26_000_001, "alarm": 0, "drv_status": 0, "stage": 5}
    assert (await client.post(jack, json="Sideways")).status_code == 400


@pytest.mark.slow
async def test_masks_and_depth(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    assert (await client.get(MASKS)).json() == []
    off = [{"id": 0, "isAlways": True, "isEnabled": False}, {"id": 1, "isAlways": False, "isEnabled": False}]
    assert (await client.put(MASKS, json=off)).json() is True
    assert (await client.get(MASKS)).json() == [{"id": 0, "isAlways": True}, {"id": 1, "isAlways": False}]
    assert (await client.put(MASKS, json=[{"id": 999, "isAlways": True, "isEnabled": False}])).status_code == 404
    robot[Firmware].reboot()
    await forward(seconds=40)
    assert robot[SensorMasks].masked == {0: True}
    assert (await client.put("/api/core/sensors/v1/depth/:enable", json={"enable": False})).status_code == 200
    assert not robot[DepthCamera].enabled
    robot[Mapping].enable(False)
    robot[Mapping].close_loops(False)
    robot[Localization].enable(False)
    robot[Firmware].reboot()
    await forward(seconds=40)
    assert robot[DepthCamera].enabled
    assert [robot[Mapping].enabled, robot[Mapping].closes_loops, robot[Localization].enabled] == [True] * 3


async def test_sleep_and_waking_up(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    async def mode() -> str:
        return str((await client.get(f"{SYSTEM}/power/status")).json()["sleepMode"])

    await forward(seconds=1)
    assert (await client.post(f"{SYSTEM}/power/:hibernate")).status_code == 200
    await forward(seconds=10)
    assert await mode() == "asleep"
    health = (await client.get(HEALTH)).json()
    assert (health["hasFatal"], health["hasLidarDisconnected"]) == (False, False)  # it was switched off, not lost
    goal = {"target": {"x": 1.0, "y": 0.0}, "move_options": {}}
    sent = await client.post(ACTIONS, json={"action_name": "slamtec.agent.actions.MoveToAction", "options": goal})
    await forward(seconds=0.5)
    ended = (await client.get(f"{ACTIONS}/{sent.json()['action_id']}")).json()["state"]
    assert ended == {"status": 4, "result": -1, "reason": "the robot is asleep"}
    assert (await client.post(f"{SYSTEM}/power/:wakeup")).status_code == 200
    await forward(seconds=0.5)
    assert await mode() == "waking_up"
    await forward(seconds=10)
    assert await mode() == "awake"


@pytest.mark.slow
async def test_a_robot_that_is_off_does_not_answer(
    robot: Robot, door: SlamwareDoor, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    minutes = {"shutdown_time_interval": 1, "restart_time_interval": 1}
    assert (await client.post(f"{SYSTEM}/power/:shutdown", json=minutes)).json() is True
    await forward(seconds=50)
    assert (await client.get(f"{SYSTEM}/power/status")).status_code == 200
    await forward(seconds=15)
    assert robot[Power].mode is PowerMode.OFF
    with pytest.raises(httpx.TransportError):
        await client.get(f"{SYSTEM}/power/status")
    await forward(seconds=70)
    power = (await client.get(f"{SYSTEM}/power/status")).json()
    assert (power["powerStage"], power["sleepMode"]) == ("running", "awake")


async def test_restart_takes_the_door_away_for_a_while(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    answer = await client.post(f"{SYSTEM}/power/:restartmodule", json={"mode": "RestartModeHard"})
    assert answer.json() is True
    await forward(seconds=5)
    with pytest.raises(httpx.TransportError):
        await client.get(f"{SYSTEM}/power/status")
    await forward(seconds=40)
    assert (await client.get(f"{SYSTEM}/power/status")).status_code == 200


@pytest.mark.parametrize("mode", ["RestartModeSoft", "RestartModeBase"])
async def test_a_module_restarts_and_the_door_stays(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, mode: str
) -> None:
    async def stage() -> str:
        return str((await client.get(f"{SYSTEM}/power/status")).json()["powerStage"])

    await forward(seconds=1)
    built = robot[Base].limits.twist
    await put(client, "base.max_moving_speed", "0.2")
    drive = robot[Driving].move_by(Pose(3.0))
    await forward(seconds=2)
    await put(client, "base.emergency_stop", "on")
    assert (await client.post(f"{SYSTEM}/power/:restartmodule", json={"mode": mode})).json() is True
    again = await client.post(f"{SYSTEM}/power/:restartmodule", json={"mode": mode})
    assert again.status_code == 403
    await forward(seconds=1)
    assert (drive.status.ended, await stage()) == (True, "restarting")
    with pytest.raises(RobotError):
        robot[Driving].move_by(Pose(0.5))
    await forward(seconds=1)
    assert robot[Base].velocity == Twist()
    await forward(seconds=9)
    assert await stage() == "running"
    assert robot[Base].limits.twist == built
    assert robot[EmergencyStop].engaged is (mode == "RestartModeSoft")
    robot[EmergencyStop].release()
    robot[Driving].move_by(Pose(0.5))
    await forward(seconds=1)
    assert robot[Base].velocity.x > 0.05


async def test_a_refused_restart_stops_nothing(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    update = robot[Firmware].download(FirmwarePackage("9", 10**9, "0" * 32, {}, url="maker:9"))
    drive = robot[Driving].move_by(Pose(3.0))
    await forward(seconds=1)
    for mode in ("Soft", "Base", "Hard"):
        refused = await client.post(f"{SYSTEM}/power/:restartmodule", json={"mode": f"RestartMode{mode}"})
        assert refused.status_code == 403
    await forward(seconds=1)
    assert [update.status.ended, drive.status.ended] == [False, False]


async def test_metres_and_seconds_count_over_the_robots_life(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    from roboglot.model.components.system.settings import Settings

    robot[Driving].move_by(Pose(1.0))
    await forward(seconds=10)
    metres = (await client.get("/api/core/statistics/v1/odometry")).json()
    assert metres == pytest.approx(1.0, abs=0.1)
    await forward(seconds=25)
    kept = robot[Settings].get(TOTALS)
    assert kept == [pytest.approx(metres, abs=0.01), pytest.approx(30.0)]
    again = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await again.start()  # as after a crash: stored values count on
    await forward(seconds=2)
    async with httpx.AsyncClient(base_url=again.endpoints[0].address, verify=False) as other:
        seconds = (await other.get("/api/core/statistics/v1/runtime")).json()
    await again.close()
    assert seconds == pytest.approx(32.0, abs=0.1)


async def test_a_restart_adds_nothing_to_metres_and_seconds(
    robot: Robot, door: SlamwareDoor, client: httpx.AsyncClient, forward: Forward
) -> None:
    async def totals() -> list[float]:
        return [(await client.get(f"/api/core/statistics/v1/{name}")).json() for name in ("odometry", "runtime")]

    robot[Driving].move_by(Pose(0.5))
    await forward(seconds=5)
    before = await totals()
    await door.close()  # as the robot's doors do when it restarts
    await forward(seconds=20)
    await door.start()
    assert await totals() == [pytest.approx(before[0], abs=0.01), pytest.approx(before[1], abs=0.1)]


@pytest.mark.parametrize("pressed", [False, True])
async def test_only_the_stop_button_outlasts_a_restart(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, pressed: bool
) -> None:
    stop = robot[EmergencyStop]
    assert isinstance(stop, SimulatedEmergencyStop)
    firmware = robot[Firmware]
    for again, seconds in ((firmware.reboot, 26), (lambda: firmware.restart(Module.BASE), 4)):
        assert await put(client, "base.emergency_stop", "on") == 200
        assert await put(client, "base.brake_release", "on") == 200
        stop.press(True) if pressed else None
        restart = again()
        await forward(seconds=seconds)
        assert (restart.status, stop.engaged, stop.brake_released) == (ActionStatus.SUCCEEDED, pressed, False)


async def test_stops_and_limits_during_a_restart_hold(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    restart = robot[Firmware].restart(Module.BASE)
    await forward(seconds=1)
    assert await put(client, "base.emergency_stop", "on") == 200
    assert await put(client, "base.max_moving_speed", "0.2") == 200
    await forward(seconds=3)
    assert (restart.status, robot[EmergencyStop].engaged) == (ActionStatus.SUCCEEDED, True)
    assert robot[Base].limits.twist.x == 0.2
    with pytest.raises(RobotError):
        robot[Driving].move_by(Pose(0.5))


@pytest.mark.parametrize("ends", ["reboot", pytest.param("power off", marks=pytest.mark.slow)])
async def test_a_stop_during_a_start_holds(robot: Robot, forward: Forward, ends: str) -> None:
    robot[Firmware].reboot() if ends == "reboot" else robot[Power].shut_down(restart_after=3.0)
    await forward(seconds=2)
    robot[EmergencyStop].engage()  # through what stays up, such as the console
    await forward(seconds=28)
    assert robot[EmergencyStop].engaged


@pytest.fixture
async def hermes(clock: LockstepClock) -> AsyncIterator[Fleet]:
    """The delivery robot."""
    database = Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig("h", "hermes")], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    yield fleet
    await fleet.close()
    database.close()


async def test_emergency_braking_is_switched(hermes: Fleet) -> None:
    robot = hermes.robots["h"]
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    async with httpx.AsyncClient(base_url=door.endpoints[0].address, verify=False) as client:
        for word, on in (("Off", False), ("On", True)):
            assert (await client.post(f"{SYSTEM}/aeb/control", json=word)).status_code == 200
            assert robot[EmergencyBraking].enabled is on
        assert (await client.post(f"{SYSTEM}/aeb/control", json="Perhaps")).status_code == 400
    await door.close()


async def test_emergency_stop_of_another_door_shows_in_health(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    robot[Legs].go_limp()
    await forward(seconds=0.5)
    assert (await client.get(HEALTH)).json()["hasSystemEmergencyStop"] is True
    assert await put(client, "base.emergency_stop", "off") == 403  # only standing up ends it
    (fault,) = (await client.get(HEALTH)).json()["baseError"]
    assert (await client.delete(f"{HEALTH}/{fault['errorCode']}")).status_code == 403  # no success: it stays
    assert (await client.get(HEALTH)).json()["baseError"] == [fault]
    robot[Legs].stand()
    await forward(seconds=4)
    assert (await client.get(HEALTH)).json()["hasSystemEmergencyStop"] is False
    assert await put(client, "base.emergency_stop", "off") == 200


async def test_jack_and_doors_are_refused_while_stopped(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    (cargo,) = {part["id"] for part in (await client.get("/api/delivery/v1/cargos")).json()[:1]}
    box = f"/api/delivery/v1/cargos/{cargo}/boxes/0"
    assert (await client.post(f"{SYSTEM}/jack/status", json="Up")).status_code == 200
    assert (await client.put(f"{box}/:open")).status_code == 200
    await forward(seconds=0.2)
    assert await put(client, "base.emergency_stop", "on") == 200
    await forward(seconds=0.1)
    height, result = robot[Jack].position, (await client.get(f"{box}/operation_result")).json()
    assert (result["stage"], result["reason"]) == ("FAILED", "the emergency stop is engaged")
    for refused in (await client.post(f"{SYSTEM}/jack/status", json="Up"), await client.put(f"{box}/:open")):
        assert (refused.status_code, refused.reason_phrase) == (403, "operation fail")
        assert refused.text == "operation fail: the emergency stop is engaged"
    options = {"move_direction": "Up"}
    sent = await client.post(ACTIONS, json={"action_name": "slamtec.agent.actions.JackMoveAction", "options": options})
    await forward(seconds=0.5)
    ended = (await client.get(f"{ACTIONS}/{sent.json()['action_id']}")).json()["state"]
    assert ended == {"status": 4, "result": -1, "reason": "the emergency stop is engaged"}
    assert 0.0 < robot[Jack].position == height
    assert await put(client, "base.emergency_stop", "off") == 200
    assert (await client.put(f"{box}/:open")).status_code == 200


async def test_last_moments_of_the_door_refuse_changes(robot: Robot, client: httpx.AsyncClient) -> None:
    robot.starts.down = "the robot restarts"
    answer = await client.put(f"{SYSTEM}/parameter", json={"param": "base.max_moving_speed", "value": "0.2"})
    assert (answer.status_code, answer.text) == (503, "Service Unavailable: the robot restarts")
    assert (await client.get(f"{SYSTEM}/power/status")).status_code == 200
