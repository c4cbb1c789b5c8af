"""Settings of the delivery service, its hours and battery rules, and the industry chapter, judged by the robot."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import httpx
import pytest

from roboglot.autonomy.navigation.context import Goal
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.logistics.industry import CallKind, Industry
from roboglot.model.components.mapping.annotations import Line, LineKind, MapAnnotations
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot
from tests.protocols.slamware.screen import API, TASKS, Screen

pytestmark = pytest.mark.world("empty")
INDUSTRY = "/api/industry/v1/tasks"


async def put(screen: Screen, path: str, body: object) -> httpx.Response:
    return await screen.client.put(f"{API}/{path}", json=body)


async def get(screen: Screen, path: str) -> Any:
    return (await screen.client.get(f"{API}/{path}")).json()


async def test_work_modes_decide_who_may_order_what(screen: Screen) -> None:
    await screen.prepare(R101=(1.0, 0.0, "ROOM"))
    assert await get(screen, "admin/mode") == {"work_mode": "MANUAL"}
    for mode, kind, accepted in (
        ("DISPATCH", "RECYCLE", False),
        ("RECYCLE", "RETURN", False),
        ("RECYCLE", "RECYCLE", True),
        ("MANUAL", "RETURN", True),
    ):
        reply = await put(screen, "admin/mode", {"work_mode": mode})
        assert reply.json() == {"result": True, "reason": ""}
        assert reply.headers["content-type"] == "application/json"
        created = (await screen.client.post(TASKS, json=screen.request("R101", kind))).json()
        assert created["result"] is accepted, (mode, kind)
    assert await get(screen, "admin/mode") == {"work_mode": "MANUAL"}
    assert (await put(screen, "admin/mode", {"work_mode": "LAZY"})).status_code == 400
    assert "DELIVERY_SETTINGS_CHANGED" in await screen.events()


@pytest.mark.slow  # two minutes; the rules: tests/autonomy/test_delivery.py
async def test_tasks_wait_for_working_hours(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(1.5, 0.0, "ROOM"))
    hours = {"hours": [{"start_time": "00:01:00", "end_time": "00:02:10"}], "restdays": [0]}
    await put(screen, "admin/working_time", hours)  # the virtual day, a Thursday, began a second ago
    assert await get(screen, "admin/working_time") == hours
    number = await screen.create("R101", "RETURN")
    await screen.forward(seconds=50)
    assert (await screen.task(number))["status"] == "READY"
    assert robot[DockContact].docked
    await screen.forward(seconds=60)
    assert (await screen.task(number))["status"] == "SUCCEEDED"
    await screen.forward(seconds=60)
    assert robot[DockContact].docked
    events = await screen.events()
    assert [event for event in events if "WORK" in event] == ["GET_OFF_WORK", "START_TO_WORK", "GET_OFF_WORK"]
    await put(screen, "admin/working_time", {"hours": [], "restdays": [4]})
    await screen.create("R101", "RETURN")
    await screen.forward(seconds=20)
    assert robot[DockContact].docked  # Thursday is a day off now
    assert (await put(screen, "admin/working_time", {"hours": [{"start_time": "25:00:00"}]})).status_code == 400


async def test_speeds_of_the_way_there(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(4.0, 0.0, "ROOM"))
    most = robot[Base].limits.twist.x
    assert await get(screen, "admin/line_speed") == {"delivery_speed": most, "return_speed": most}
    assert (await put(screen, "admin/line_speed", {"delivery_speed": 0.25})).status_code == 200
    assert await get(screen, "admin/line_speed") == {"delivery_speed": 0.25, "return_speed": most}
    assert (await put(screen, "admin/line_speed", {"return_speed": 2.0 * most})).status_code == 200
    assert await get(screen, "admin/line_speed") == {
        "delivery_speed": 0.25,
        "return_speed": most,
    }  # it drives no faster
    await screen.create("R101", "RETURN")
    await screen.until("ON_DELIVERING", within=5)
    await screen.forward(seconds=8)
    assert robot[Base].velocity.x == pytest.approx(0.25, abs=0.03)
    assert (await put(screen, "admin/line_speed", {"delivery_speed": 0})).status_code == 400


async def test_move_options_are_merged_and_act(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(1.5, 0.0, "ROOM"))
    default = await get(screen, "admin/move_options")
    assert (default["mode"], default["flags"], default["speed_ratio"]) == (0, [], 0)
    await put(screen, "admin/move_options", {"flags": ["with_yaw"], "yaw": 1.57})
    await put(screen, "admin/move_options", {"speed_ratio": 0.5})
    options = await get(screen, "admin/move_options")
    assert (options["flags"], options["yaw"], options["speed_ratio"]) == (["with_yaw"], 1.57, 0.5)
    await screen.create("R101", "FOOD_DELIVERY")
    await screen.until("ARRIVED_AT_TARGET")
    assert screen.pose.yaw == pytest.approx(1.57, abs=0.1)
    await screen.client.delete(TASKS)
    assert (await put(screen, "admin/move_options", {"mode": 7})).status_code == 400
    assert (await screen.client.put(f"{API}/admin/move_options")).status_code == 200
    assert await get(screen, "admin/move_options") == default


async def _goal_of_delivery(screen: Screen, robot: Robot) -> Goal:
    """Order food, and return the goal that the robot then drives to."""
    await screen.create("R101", "FOOD_DELIVERY")
    for _ in range(40):
        await screen.forward(seconds=0.5)
        for action in robot.actions.running(BASE):
            if isinstance(action.goal, Goal):
                return action.goal
    raise AssertionError("it does not drive")


async def test_all_move_options_reach_the_drive(screen: Screen, robot: Robot) -> None:
    """Precision and two of the flags were stored and shown, and nothing else."""
    await screen.prepare(R101=(2.0, 1.0, "ROOM"))
    await put(screen, "admin/move_options", {"acceptable_precision": 0.4})
    await put(screen, "admin/move_options", {"flags": ["find_path_ignoring_dynamic_obstacles"]})
    options = (await _goal_of_delivery(screen, robot)).options
    assert (options.tolerance, options.waits) == (0.4, True)
    await screen.client.delete(TASKS)
    corners = Point(0, 0), Point(2, 0), Point(2, 2)
    lines = [Line(0, LineKind.TRACK, start, end) for start, end in itertools.pairwise(corners)]
    await robot[MapAnnotations].change(lambda now: now.with_new(*lines))
    await put(screen, "admin/move_options", {"mode": 1, "flags": ["precise", "with_directed_virtual_track"]})
    goal = await _goal_of_delivery(screen, robot)
    assert goal.options.tolerance == 0.4  # what counts at an occupied target, whatever the precision at a free one
    assert goal.points[-2:] == (Point(2, 0), Point(2, 1))
    await screen.client.delete(TASKS)
    await put(screen, "admin/move_options", {"acceptable_precision": 0})
    assert (await _goal_of_delivery(screen, robot)).options.tolerance == 0.05


async def test_stored_flags_act_as_they_are_shown(screen: Screen, robot: Robot) -> None:
    """An earlier version took unlisted flags."""
    await put(screen, "admin/move_options", {"flags": ["with_yaw"], "yaw": 1.57})
    policy = robot[Delivery].policy
    words = {**policy.words, "flags": ["with_yaw", "fast", None]}
    await robot[Delivery].change_policy(lambda policy: replace(policy, words=words))
    options = await get(screen, "admin/move_options")
    assert (options["flags"], options["yaw"], robot[Delivery].policy.yaw) == (["with_yaw"], 1.57, 1.57)
    await put(screen, "admin/move_options", {"speed_ratio": 0.5})
    assert (robot[Delivery].policy.yaw, robot[Delivery].policy.words["flags"]) == (1.57, ["with_yaw"])


async def test_the_time_for_food_can_be_set(screen: Screen) -> None:
    await screen.prepare(T1=(1.0, 0.0, "TABLE"))
    settings = (await get(screen, "settings"))["delivery_settings"]
    assert settings["low_battery_level"] == {"level1": 6, "level2": 10, "level3": 20, "level4": 30}
    assert settings["timeout_settings"]["food_pickup_timeout"] == 120
    assert (await put(screen, "settings/timeout", {"food_pickup_timeout": 10})).status_code == 200
    assert (await get(screen, "settings"))["delivery_settings"]["timeout_settings"]["food_pickup_timeout"] == 10
    number = await screen.create("T1", "FOOD_DELIVERY")
    await screen.until("ARRIVED_AT_TARGET")
    await screen.forward(seconds=11)
    task = await screen.task(number)
    assert (task["status"], task["result"]["reason"]) == ("FAILED", "NO_PICKUP")
    assert "DELIVERY_NO_PICKUP" in await screen.events()


async def test_a_low_battery_cancels_and_sends_it_home(screen: Screen, robot: Robot) -> None:
    await screen.prepare(far=(4.0, 0.0, "ROOM"))
    battery: Any = robot[Battery]
    battery.set_charge(0.25)
    refused = (await screen.client.post(TASKS, json=screen.request("far", "TAKEOUT", 0))).json()
    assert refused["result"] is False
    number = await screen.create("far", "RETURN")
    await screen.until("ON_DELIVERING", within=5)
    await screen.forward(seconds=4)
    battery.set_charge(0.09)
    await screen.until("GOING_HOME", within=10)
    task = await screen.task(number)
    assert (task["status"], task["result"]["reason"]) == ("CANCELED", "LOW_BATTERY")
    await screen.until("IDLE")
    assert robot[DockContact].docked
    later = await screen.create("far", "RETURN")
    await screen.forward(seconds=20)
    assert (await screen.task(later))["status"] == "READY"
    battery.set_charge(0.85)
    await screen.until("ON_DELIVERING", within=30)
    events = await screen.events()
    assert [event for event in events if event in ("LOW_BATTERY", "START_TO_WORK")] == ["LOW_BATTERY", "START_TO_WORK"]


async def test_password_language_configuration_and_voice(screen: Screen) -> None:
    await screen.prepare()
    assert await get(screen, "admin/password") == {"delivery_admin_password": {"enable": False}}
    assert (await put(screen, "admin/password", {"enable": True})).json()["result"] is False
    await put(screen, "admin/password", {"enable": True, "password": "0815"})
    assert await get(screen, "admin/password") == {"delivery_admin_password": {"enable": True, "password": "0815"}}
    await put(screen, "admin/password", {"enable": False})
    assert (await get(screen, "admin/password"))["delivery_admin_password"]["enable"] is False
    await put(screen, "admin/language", {"language": "en-US"})
    assert await get(screen, "admin/language") == {"language": "en-US"}
    machine = await get(screen, "configurations")
    assert machine["is_manage_by_cloud"] is False
    assert machine["cargos"] == await get(screen, "cargos")
    assert (await get(screen, "voice_resources"))["result"] is False


async def test_boxes_report_their_last_operation(screen: Screen, robot: Robot) -> None:
    from roboglot.model.components.logistics.cargo import Cargo

    await screen.prepare()
    path = f"cargos/{screen.cargo}/boxes/0/operation_result"
    assert (await screen.client.get(f"{API}/{path}")).status_code == 404
    await screen.operate(0, ":open")
    result = await get(screen, path)
    assert (result["type"], result["stage"], result["cargo_id"]) == ("OPEN", "IN_PROGRESS", screen.cargo)
    await screen.forward(seconds=4)
    result = await get(screen, path)
    assert (result["stage"], result["box"]["door_status"], result["box"]["lock_status"]) == ("DONE", "OPEN", "UNLOCKED")
    cargo: Any = robot[Cargo]
    cargo.hold_hand_into(0, True)
    await screen.operate(0, ":close")
    await screen.forward(seconds=4)
    result = await get(screen, path)
    assert (result["type"], result["stage"], result["reason"]) == ("CLOSE", "FAILED", "CLOSE_DOOR_STALLED")
    assert (result["box"]["status"], len(result["box"]["errors"])) == ("ERROR", 1)
    assert [box["id"] for box in await get(screen, f"cargos/{screen.cargo}/boxes")] == screen.boxes


async def test_templates_and_calls(screen: Screen, robot: Robot) -> None:
    await screen.prepare(line=(1.0, 0.0, "ROOM"), store=(2.0, 0.0, "ROOM"))
    steps = [{"display_name": "store", "action": "load", "wait_time": 5}, {"display_name": "line"}]
    made = (await screen.client.post(f"{INDUSTRY}/templates", json={"name": "supply", "action_list": steps})).json()
    key = made["task_template_key"]
    assert (await screen.client.get(f"{INDUSTRY}/templates")).json() == [made]
    lost = {"name": "lost", "action_list": [{"display_name": "nowhere"}]}
    assert (await screen.client.post(f"{INDUSTRY}/templates", json=lost)).status_code == 404
    await robot[Industry].call(CallKind.PLAIN, "line")
    call = await robot[Industry].call(CallKind.BY_TEMPLATE, "line", template=key)
    query = {"type": "carry_calling_by_template"}
    (task,) = (await screen.client.get(INDUSTRY, params=query)).json()
    assert (task["id"], task["status"], task["task"]["template_key"]) == (call.id, "READY", key)
    assert task["task"]["task_targets"][0] == {"target_name": "store", "action": "load", "wait_time": 5}
    for status in ("RUNNING", "SUCCEEDED"):
        event = {"task_id": call.id, "status": status}
        assert (await screen.client.post(f"{INDUSTRY}/events", json=event)).status_code == 200
        (task,) = (await screen.client.get(INDUSTRY, params={**query, "status": status.lower()})).json()
        assert task["status"] == status
    assert (await screen.client.post(f"{INDUSTRY}/events", json=event)).status_code == 403
    assert len((await screen.client.get(INDUSTRY)).json()) == 1
    assert (await screen.client.delete(f"{INDUSTRY}/templates/{key}")).json()["result"] is True
    assert (await screen.client.delete(f"{INDUSTRY}/templates/{key}")).status_code == 404
