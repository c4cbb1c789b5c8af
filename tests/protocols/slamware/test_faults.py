"""Every fault that is wrong with the robot itself is a health record of its own; what fails in use is tested there."""

import httpx
import pytest

from roboglot.model.components.system.health import Fault, FaultLevel, Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.system.health import record_of
from roboglot.simulation.components.system.health_monitor import WATCHES
from roboglot.simulation.world.world import World
from roboglot.testing import Forward

HEALTH = "/api/core/system/v1/robot/health"
RECORDS = {  # kind: robot time until it is reported, errorCode
    "low_battery": (0.5, 0x1020100),
    "motor_fault": (0.5, 0x2030100),
    "cliff": (0.5, 0x1047003),
    "bumper_stuck": (6.0, 0x2040100),
    "emergency_stop": (0.5, 0x2010100),
    "brake_released": (0.5, 0x2010700),
    "wifi_loss": (1.5, 0x1017005),
    "full_disk": (0.5, 0x2017006),
    "lidar_gone": (1.5, 0x4047007),
    "depth_camera_gone": (0.5, 0x204700A),
}


@pytest.mark.world("empty", body="hermes")
async def test_faults_of_the_robot(client: httpx.AsyncClient, robot: Robot, world: World, forward: Forward) -> None:
    await forward(seconds=1)
    for kind, (seconds, code) in RECORDS.items():
        world.faults.inject(kind, "a")
        await forward(seconds=seconds)
        health = (await client.get(HEALTH)).json()
        assert [record["errorCode"] for record in health["baseError"]] == [code], kind
        assert health["hasLidarDisconnected"] == (kind == "lidar_gone")
        assert health["hasDepthCameraDisconnected"] == (kind == "depth_camera_gone")
        assert health["hasSystemEmergencyStop"] == (kind == "emergency_stop")
        world.faults.clear()
        await forward(seconds=1.5)
        assert not robot[Health].faults, kind


@pytest.mark.world("empty", body="hermes")
async def test_a_real_robot_that_is_not_reached(client: httpx.AsyncClient, robot: Robot) -> None:
    assert not (await client.get(HEALTH)).json()["hasSdpDisconnected"]
    link = robot.add(Link, Link("slamware://robot", robot.clock, robot.events, robot[Health]))
    for state, lost in ((LinkState.UP, False), (LinkState.LOST, True), (LinkState.UP, False)):
        link.move_to(state)
        health = (await client.get(HEALTH)).json()
        assert health["hasSdpDisconnected"] == lost == bool(health["baseError"])


@pytest.mark.slow
@pytest.mark.world("office", body="hermes")
async def test_a_robot_that_was_carried_off(
    client: httpx.AsyncClient, robot: Robot, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    quality = "/api/core/slam/v1/localization/quality"
    assert (await client.get(quality)).json() > 80
    world.faults.inject("lost_localization", "a", x=21.0, y=14.0, degrees=37.0)
    await forward(seconds=6)
    assert (await client.get(quality)).json() < 30
    assert [record["errorCode"] for record in (await client.get(HEALTH)).json()["baseError"]] == [0x2010900]
    goal = {"action_name": "slamtec.agent.actions.MoveToAction", "options": {"target": {"x": 9.0, "y": 0.0}}}
    id = (await client.post("/api/core/motion/v1/actions", json=goal)).json()["action_id"]
    await forward(seconds=20)
    ended = (await client.get(f"/api/core/motion/v1/actions/{id}")).json()["state"]
    assert ended == {"status": 4, "result": -1, "reason": "LOCALIZATION_LOST"}


def test_no_two_faults_share_a_number() -> None:
    names = {watch.name: watch.part for watch in WATCHES} | {"lidar lost": "lidar", "bumper stuck": "bumper"}
    codes = {record_of(Fault(1, name, part, FaultLevel.ERROR, name, 0.0)).error_code for name, part in names.items()}
    assert len(codes) == len(names)
