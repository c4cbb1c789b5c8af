"""Gifts of a cloud: maps, voice packages, tasks of cabinets and rounds. A folder plays it."""

from __future__ import annotations

import json
from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.model.components.energy.power import Power
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose
from tests.protocols.slamware.screen import API, Screen

pytestmark = pytest.mark.world("office", body="hermes")
MULTI, INDUSTRY = "/api/multi-floor", "/api/industry/v1/tasks"


@pytest.fixture
def cloud(tmp_path: Path) -> Path:
    """The cloud's folder for robot a."""
    (tmp_path / "a" / "tasks").mkdir(parents=True)
    return tmp_path / "a"


@pytest.fixture
async def door(robot: Robot, forward: Forward, cloud: Path) -> AsyncIterator[SlamwareDoor]:
    """A door of a robot that a cloud has in its care."""
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0, cloud=str(cloud.parent)))
    await door.start()
    yield door
    await door.close()
    await forward(seconds=4)


def give(cloud: Path, name: str, **task: Any) -> Callable[[], str]:
    """Have the cloud give a task; return its outcome."""
    (cloud / "tasks" / f"{name}.json").write_text(json.dumps(task))
    return lambda: next((cloud / "tasks").glob(f"{name}.[!w]*")).suffix


async def test_the_clouds_map_comes_first(client: httpx.AsyncClient, forward: Forward, cloud: Path) -> None:
    await forward(seconds=2)
    mine = (await client.get("/api/core/slam/v1/maps/stcm")).content
    assert (await client.get(f"{MULTI}/status")).json()["is_managed_by_cloud"] is True
    (cloud / "map.stcm").write_bytes(mine)
    await client.get("/api/platform/v1/events")
    assert (await client.post(f"{MULTI}/map/v1/stcm/:reload")).status_code == 200
    assert (await client.get(f"{MULTI}/status")).json()["map_load_status"] == "LOADED"
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert "SYNC_MAP_FROM_CLOUD" in events
    assert (await client.post(f"{MULTI}/map/v1/stcm/:reload")).status_code == 200  # unchanged: nothing arrives
    assert "SYNC_MAP" not in (await client.get("/api/platform/v1/events")).text
    assert (await client.post(f"{MULTI}/map/v1/scene/unbind", json={"keep_local_map": True})).status_code == 200
    assert (await client.get(f"{MULTI}/status")).json()["is_managed_by_cloud"] is False
    (cloud / "map.stcm").write_bytes(b"STCM nonsense")
    assert (await client.post(f"{MULTI}/map/v1/stcm/:reload")).status_code == 200


async def test_voice_packages(client: httpx.AsyncClient, world: World, forward: Forward, cloud: Path) -> None:
    await forward(seconds=1)
    package = {"version": "3", "content": "欢迎", "interval_count": 1, "play_type": 2, "repeat_count": 3}
    (cloud / "voice.json").write_text(json.dumps([package]))
    assert (await client.get(f"{API}/voice_resources")).json() == {"result": True, "msg": "", "data": [package]}
    (cloud / "voice.json").write_text("[")
    assert (await client.get(f"{API}/voice_resources")).status_code == 400
    await client.put("/api/core/system/v1/network/status", json={"networkmode": 2})
    await client.put("/api/core/system/v1/network/apn", json={"apn": "nonsense"})
    await forward(seconds=2)
    away = (await client.get(f"{API}/voice_resources")).json()
    assert (away["result"], away["msg"]) == (False, "the cloud is out of reach")


@pytest.mark.slow
async def test_a_task_of_a_cabinet(screen: Screen, robot: Robot, cloud: Path) -> None:
    await screen.prepare(cabinet=(1.5, 0.0, ""), R101=(3.0, 0.0, "ROOM"))
    await screen.client.put(f"{API}/admin/mode", json={"work_mode": "DISPATCH"})  # orders come only from the cloud
    cargos = [{"cargo_id": screen.cargo, "boxes": ["000"]}]
    what = give(cloud, "17", type="STATION_TAKEOUT", location={"poi_name": "R101", "task_points": ["cabinet"]},
                cargos=cargos)  # fmt: skip
    await screen.forward(seconds=6)
    assert what() == ".taken"
    stage = await screen.stage()
    assert (stage["stage"], stage["milestone"]) == ("ON_DELIVERING", "GOING_TO_CABINET")
    assert stage["info"]["task"]["station_id"] == "cabinet"
    for _ in range(30):
        if (stage := await screen.stage())["milestone"] == "ROBOT_OPERATE_CABINET":
            break
        await screen.forward(seconds=1)
    await screen.forward(seconds=5)
    assert (await screen.box(0))["door_status"] == "OPEN"
    assert_pose(screen.pose, x=1.5, y=0.0, within=0.15)
    simulated: Any = robot[Cargo]
    simulated.put(0, 1.0)  # the cabinet's part
    await screen.until("ARRIVED_AT_TARGET")
    assert_pose(screen.pose, x=3.0, y=0.0, within=0.15)
    assert ((await screen.box(0))["door_status"], (await screen.box(0))["stock_status"]) == ("CLOSED", "FULL")
    events = await screen.events()
    assert [e for e in events if e in ("NEW_TASK_RECEIVED", "STATION_TASK_START", "OPERATING_CABINET")] == [
        "NEW_TASK_RECEIVED",
        "STATION_TASK_START",
        "OPERATING_CABINET",
    ]
    tasks = (await screen.client.get(f"{API}/tasks")).json()
    assert [(task["task"]["type"], task["task"]["order_id"]) for task in tasks] == [("STATION_TAKEOUT", "17")]


@pytest.mark.slow  # a long story; in short: test_a_task_of_a_cabinet
async def test_a_cabinet_that_gives_nothing(screen: Screen, cloud: Path) -> None:
    await screen.prepare(cabinet=(1.5, 0.0, ""), R101=(3.0, 0.0, "ROOM"))
    await screen.wait_for_pickups(seconds=40)
    cargos = [{"cargo_id": screen.cargo, "boxes": ["000"]}]
    give(cloud, "18", type="STATION_TAKEOUT", location={"poi_name": "R101", "task_points": ["cabinet"]}, cargos=cargos)
    await screen.forward(seconds=40)
    assert (await screen.task("18"))["status"] == "RUNNING"
    await screen.forward(seconds=40)
    task = await screen.task("18")
    assert (task["status"], task["result"]["reason"]) == ("FAILED", "the cabinet put nothing into a box")
    assert (await screen.box(0))["door_status"] == "CLOSED"


@pytest.mark.slow  # a long story; in short: test_a_task_of_a_cabinet
async def test_an_industrial_round(screen: Screen, cloud: Path) -> None:
    await screen.prepare(saw=(1.5, 0.0, ""), press=(3.0, 0.0, ""))
    targets: list[dict[str, object]] = [
        {"target_name": "saw", "action": "load", "wait_time": 20},
        {"target_name": "press", "action": "unload"},
    ]
    give(cloud, "round", type="INDUSTRY", task_targets=targets, order_id="r-1")
    seen: list[str] = []
    for _ in range(90):
        await screen.forward(seconds=1)
        (task,) = (await screen.client.get(INDUSTRY, params={"status": "all"})).json() or [None]
        if task and (stage := task["result"].get("stage", "")) not in seen[-1:]:
            seen.append(stage)
        if seen[-1:] == ["WAIT_OPERATION"]:
            break
    assert seen == [
        "GOING_TO_TASK_POINT",
        "ARRIVED_AT_TASK_POINT",
        "GOING_TO_TARGET_POINT",
        "WAIT_OPERATION",
    ]
    assert_pose(screen.pose, x=3.0, y=0.0, within=0.15)
    assert (task["task"]["type"], task["task"]["order_id"], task["status"]) == ("INDUSTRY", "r-1", "RUNNING")
    assert task["task"]["task_targets"] == [targets[0], targets[1] | {"wait_time": 0}]
    assert (await screen.client.get(INDUSTRY, params={"type": "carry_calling"})).json() == []
    assert (await screen.client.get(f"{API}/tasks")).json() == []
    assert await screen.say("end_operation") == 204
    await screen.forward(seconds=1)
    (task,) = (await screen.client.get(INDUSTRY, params={"type": "industry", "status": "succeeded"})).json()
    assert task["status"] == "SUCCEEDED"


@pytest.mark.parametrize("ended", [True, False])
async def test_operation_without_an_end_is_reported(screen: Screen, cloud: Path, ended: bool) -> None:
    """The order ended as if a person had been there."""
    await screen.prepare(press=(1.0, 0.0, ""))
    await screen.wait_for_pickups(seconds=40)
    give(cloud, "round", type="INDUSTRY", task_targets=[{"target_name": "press", "action": "unload"}], order_id="r-1")
    for _ in range(40):
        await screen.forward(seconds=1)
        (task,) = (await screen.client.get(INDUSTRY, params={"status": "all"})).json() or [None]
        if task and task["result"].get("stage") == "WAIT_OPERATION":
            break
    if ended:
        assert await screen.say("end_operation") == 204
    await screen.forward(seconds=1 if ended else 42)
    (task,) = (await screen.client.get(INDUSTRY, params={"status": "all"})).json()
    assert (task["status"], task["result"]["reason"]) == ("SUCCEEDED", "" if ended else "NO_PICKUP")


async def test_impossible_and_unknown_tasks_are_refused(
    screen: Screen, robot: Robot, world: World, cloud: Path, forward: Forward
) -> None:
    await screen.prepare(R101=(2.0, 0.0, "ROOM"))
    give(cloud, "a", type="DISINFECT", location={"poi_name": "R101"})
    nowhere = give(cloud, "b", type="RETURN", location={"poi_name": "nowhere"})
    nonsense = give(cloud, "c", type="FLY")
    (cloud / "tasks" / "d.json").write_bytes(b"\xff" * 100_000)
    (cloud / "tasks" / "d2.json").write_bytes(b'{"type": "RETURN", "location": {"poi_name": "\xff"}}')
    await forward(seconds=8)
    events = await screen.events()
    assert "DISINFECT_TASK_FAILED" in events
    assert "UTF-8" in (cloud / "tasks" / "d2.why").read_text()
    assert (nowhere(), nonsense()) == (".refused", ".refused")
    assert "nowhere" in (cloud / "tasks" / "b.why").read_text()
    assert (cloud / "tasks" / "d.refused").exists()
    world.faults.inject("low_battery", "a", charge=0.19)
    late = give(cloud, "e", type="RETURN", location={"poi_name": "R101"})
    await forward(seconds=6)
    assert late() == ".refused"  # level 3: nothing more from the cloud
    assert Power in robot


@pytest.mark.slow
async def test_no_task_comes_without_internet(screen: Screen, world: World, cloud: Path) -> None:
    await screen.prepare(R101=(2.0, 0.0, "ROOM"))
    await screen.client.put("/api/core/system/v1/network/apn", json={"apn": "nonsense"})
    world.faults.inject("wifi_loss", "a")
    await screen.forward(seconds=2)
    what = give(cloud, "1", type="RETURN", location={"poi_name": "R101"})
    await screen.forward(seconds=12)
    assert what() == ".json"
    world.faults.clear()
    await screen.forward(seconds=15)
    assert what() == ".taken"
