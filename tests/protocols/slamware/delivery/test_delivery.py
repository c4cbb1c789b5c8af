"""Delivery through a real socket: the simulated robot really drives, waits, opens and shuts."""

from __future__ import annotations

from typing import Any

import pytest

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.robot import Robot
from roboglot.testing import assert_pose
from tests.protocols.slamware.screen import API, TASKS, Screen

pytestmark = pytest.mark.world("empty")


async def test_takeout_from_door_of_box_to_way_home(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(2.0, 1.0, "ROOM"), P=(0.0, 0.5, "PARKING"))
    number = await screen.create("R101", "TAKEOUT", 0, 1)
    assert (await screen.stage())["stage"] == "ON_DELIVERING"
    assert (await screen.client.get(f"{API}/cargos/assigned")).json() == [
        {"target": "R101", "order_id": number, "cargo_id": screen.cargo, "boxes": ["000", "001"]}
    ]
    assert await screen.say("start_pickup") == 403
    stage = await screen.until("ARRIVED_AT_TARGET")
    assert_pose(screen.pose, x=2.0, y=1.0, deg=0, within=0.15, within_deg=6)
    assert stage["info"]["task"]["order_id"] == number
    assert (stage["pickup"]["num_total"], stage["pickup"]["num_picked_up"]) == (2, 0)
    assert await screen.say("end_pickup") == 403
    assert await screen.say("start_pickup") == 204
    await screen.operate(0, ":open")
    await screen.forward(seconds=4)
    assert (await screen.box(0))["lock_status"] == "UNLOCKED"
    assert await screen.say("end_pickup") == 204
    await screen.forward(seconds=6)
    assert (await screen.box(0))["door_status"] == "CLOSED"
    assert (await screen.box(1))["door_status"] == "OPEN"  # the next one opens by itself
    assert (await screen.stage())["pickup"]["num_picked_up"] == 1
    assert await screen.say("end_pickup") == 204
    await screen.forward(seconds=4)
    task = await screen.task(number)
    assert (task["status"], task["result"]["reason"]) == ("SUCCEEDED", "")
    assert [entry["result"] for entry in task["result"]["pickup_result"]] == ["SUCCEEDED", "SUCCEEDED"]
    assert (await screen.client.get(f"{API}/cargos/assigned")).json() == []
    await screen.until("ON_RETURNING")
    await screen.until("IDLE")
    assert_pose(screen.pose, x=0.0, y=0.5, within=0.15)
    assert "DELIVERY_TASK_START" in await screen.events()


@pytest.mark.slow  # a long story
async def test_unclaimed_parcel_goes_back_to_reception(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(2.0, 0.0, "ROOM"), desk=(0.0, 1.0, "RECEPTION"))
    cargo: Any = robot[Cargo]
    await screen.operate(0, ":open")
    await screen.forward(seconds=4)
    cargo.put(0, 1.0)
    number = await screen.create("R101", "TAKEOUT", 0)
    await screen.forward(seconds=3)
    assert (await screen.box(0))["lock_status"] == "LOCKED"  # it does not drive with an open box
    await screen.until("ARRIVED_AT_TARGET")
    await screen.forward(seconds=301)
    task = await screen.task(number)
    assert (task["status"], task["result"]["reason"]) == ("FAILED", "NO_PICKUP")
    collect = (await screen.client.get(TASKS, params={"type": "collect"})).json()[0]
    assert collect["task"]["target"] == "desk"
    assert collect["task"]["failed_tasks"][0]["target"] == "R101"
    await screen.until("ARRIVED_AT_TARGET")
    assert_pose(screen.pose, x=0.0, y=1.0, within=0.15)
    events = await screen.events()
    assert [e for e in events if "NO_PICKUP" in e or "RECEPTION" in e] == [
        "DELIVERY_NO_PICKUP",
        "BACK_TO_RECEPTION_FOR_FAILED_ORDER",
    ]
    assert await screen.say("start_pickup") == 204
    await screen.operate(0, ":open")
    await screen.forward(seconds=95)  # taken but not confirmed: the door closes, and the box still counts as full
    assert (await screen.box(0))["lock_status"] == "LOCKED"
    assert (await screen.task(collect["task"]["order_id"]))["status"] == "FAILED"
    assert "COLLECT_NO_PICKUP" in await screen.events()


@pytest.mark.slow
async def test_people_at_the_screen_hold_the_robot(screen: Screen) -> None:
    await screen.prepare(R101=(3.0, 0.0, "ROOM"))
    execution = {"enable_task_execution": False}
    assert (await screen.client.put(f"{TASKS}/:task_execution", json=execution)).json() == execution
    number = await screen.create("R101", "RETURN")
    await screen.forward(seconds=10)
    assert_pose(screen.pose, x=0.0, y=0.0, within=0.02)
    ready = await screen.task(number)
    assert ready["status"] == "READY"
    assert "stage" not in ready["result"]  # the manual has no word for it
    await screen.client.put(f"{TASKS}/:task_execution", json={"enable_task_execution": True})
    await screen.forward(seconds=3)
    moving = screen.pose.x
    assert moving > 0.3
    await screen.client.put(f"{TASKS}/:task_execution", json=execution)
    await screen.forward(seconds=2)
    held = screen.pose
    await screen.forward(seconds=20)
    assert screen.pose.distance_to(held) < 0.02
    assert (await screen.task(number))["status"] == "RUNNING"
    await screen.client.put(f"{TASKS}/:task_execution", json={"enable_task_execution": True})
    await screen.forward(seconds=15)
    assert (await screen.task(number))["status"] == "SUCCEEDED"


async def test_cancel_brakes_and_finish_ends_as_succeeded(screen: Screen) -> None:
    await screen.prepare(far=(4.0, 0.0, "ROOM"), near=(1.0, 0.0, "ROOM"))
    batch = [screen.request("far", "RETURN"), screen.request("near", "GUIDE"), screen.request("near", "RETURN")]
    reply = (await screen.client.post(f"{TASKS}/:batch", json=batch)).json()
    first, second, third = reply["order_ids"]
    await screen.forward(seconds=3)
    running = (await screen.client.get(TASKS, params={"status": "running"})).json()
    assert [task["task"]["order_id"] for task in running] == [first]
    assert (await screen.client.delete(f"{TASKS}/{running[0]['id']}")).status_code == 200
    assert (await screen.client.delete(f"{TASKS}/orders/{third}")).status_code == 200
    assert (await screen.client.delete(f"{TASKS}/orders/unknown")).status_code == 404
    await screen.until("GOING_HOME")
    assert [(await screen.task(n))["status"] for n in (first, second, third)] == ["CANCELED", "SUCCEEDED", "CANCELED"]
    assert_pose(screen.pose, x=1.0, y=0.0, within=0.15)
    two = [await screen.create("far", "RETURN"), await screen.create("near", "RETURN")]
    await screen.forward(seconds=2)
    assert await screen.say("task_finish") == 204
    await screen.until("GOING_HOME", within=3)
    assert [(await screen.task(n))["status"] for n in two] == ["SUCCEEDED", "SUCCEEDED"]
    three = await screen.create("far", "RETURN")
    assert (await screen.client.delete(TASKS)).status_code == 200
    await screen.forward(seconds=2)
    assert (await screen.task(three))["status"] == "CANCELED"


@pytest.mark.slow  # in short: test_takeout_from_door_of_box_to_way_home
async def test_stops_on_the_way_wait_for_the_operation(screen: Screen) -> None:
    await screen.prepare(A01=(1.0, 0.0, "ROOM"), A02=(1.0, 1.5, "ROOM"), end=(2.5, 1.5, "TABLE"))
    await screen.wait_for_pickups(seconds=40)
    number = await screen.create("end", "RECYCLE", stops=["A01", "A02"])
    assert (await screen.stage())["stage"] == "GOING_TO_TASK_POINT"
    stage = await screen.until("ARRIVED_AT_TASK_POINT")
    assert stage["info"]["location"] == {"poi_name": "A01", "type": "ROOM"}
    assert_pose(screen.pose, x=1.0, y=0.0, within=0.15)
    assert await screen.say("end_operation") == 204
    await screen.until("GOING_TO_TASK_POINT", within=5)
    await screen.until("ARRIVED_AT_TASK_POINT")
    await screen.forward(seconds=38)
    assert (await screen.stage())["stage"] == "ARRIVED_AT_TASK_POINT"
    await screen.forward(seconds=3)  # no confirmation to go on
    await screen.until("ARRIVED_AT_TARGET")
    assert_pose(screen.pose, x=2.5, y=1.5, within=0.15)
    assert await screen.say("end_pickup") == 204
    await screen.forward(seconds=1)
    task = await screen.task(number)
    assert task["status"] == "SUCCEEDED"
    points = [(entry["task_point_id"], entry["result"]) for entry in task["result"]["pickup_result"]]
    assert points == [("A01", "SUCCEEDED"), ("A02", "FAILED")]


async def test_all_boxes_open_for_those_who_help_themselves(screen: Screen) -> None:
    await screen.prepare(lobby=(1.0, 0.0, "ROOM"))
    number = await screen.create("lobby", "TAKEOUT_DISTRIBUTE", 0, 1)
    await screen.until("ARRIVED_AT_TARGET")
    await screen.forward(seconds=4)
    assert [(await screen.box(box))["door_status"] for box in (0, 1)] == ["OPEN", "OPEN"]
    assert await screen.say("end_pickup") == 204
    await screen.forward(seconds=6)
    assert [(await screen.box(box))["door_status"] for box in (0, 1)] == ["CLOSED", "CLOSED"]
    assert (await screen.task(number))["status"] == "SUCCEEDED"


async def test_it_goes_on_after_an_emergency_stop(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(3.0, 0.0, "ROOM"))
    number = await screen.create("R101", "RETURN")
    await screen.forward(seconds=3)
    robot[EmergencyStop].engage()
    await screen.forward(seconds=10)
    assert (await screen.stage())["stage"] == "DEVICE_ERROR"
    assert (await screen.task(number))["status"] == "RUNNING"
    robot[EmergencyStop].release()
    await screen.until("GOING_HOME")
    assert (await screen.task(number))["status"] == "SUCCEEDED"
    assert_pose(screen.pose, x=3.0, y=0.0, within=0.15)


async def test_leaves_its_dock_for_an_order_and_returns(screen: Screen, robot: Robot) -> None:
    await screen.prepare(R101=(2.0, 0.0, "ROOM"))
    assert robot[DockContact].docked
    await screen.create("R101", "RETURN")
    await screen.until("GOING_HOME")
    assert "START_FROM_DOCK" in await screen.events()
    await screen.until("IDLE", within=120)
    assert robot[DockContact].docked


async def test_unacceptable_orders_are_refused(screen: Screen) -> None:
    await screen.prepare(R101=(1.0, 0.0, "ROOM"))
    await screen.client.put(f"{TASKS}/:task_execution", json={"enable_task_execution": False})
    await screen.create("R101", "TAKEOUT", 0)
    for body in (
        screen.request("nowhere", "RETURN"),
        screen.request("R101", "RETURN", stops=["nowhere"]),
        screen.request("R101", "TAKEOUT"),
        screen.request("R101", "TAKEOUT", 0),  # another order has it
        screen.request("R101", "TAKEOUT", 99),
    ):
        reply = await screen.client.post(TASKS, json=body)
        assert reply.status_code == 200
        assert (reply.json()["result"], len(reply.json()["errors"])) == (False, 1), body
    assert len((await screen.client.get(TASKS)).json()) == 1
    bad = screen.request("R101", "DANCE")
    assert (await screen.client.post(TASKS, json=bad)).status_code == 400
    assert (await screen.client.get(f"{API}/cargos/{screen.cargo}/boxes/99")).status_code == 404
    same = [(await screen.client.get(f"{API}/cargos/{screen.cargo}/boxes/{box}")).json() for box in ("0", "000")]
    assert same[0] == same[1] == same[0] | {"id": 0}, "orders write box 0 as 000"
    assert (await screen.client.get(f"{API}/cargos/{screen.cargo}/boxes/x")).status_code == 400
    assert (await screen.client.get(f"{API}/cargos/other/boxes")).status_code == 404
    assert (await screen.client.put(f"{API}/cargos/{screen.cargo}/boxes/0/:kick")).status_code == 400


async def test_stop_button_ends_task_and_leaves_robot_there(screen: Screen) -> None:
    await screen.prepare(R101=(4.0, 0.0, "ROOM"))
    number = await screen.create("R101", "RETURN")
    await screen.forward(seconds=4)
    assert (await screen.client.delete("/api/core/motion/v1/actions/:current")).status_code == 200
    await screen.forward(seconds=2)
    there = screen.pose
    task = await screen.task(number)
    assert (task["status"], task["result"]["reason"]) == ("FAILED", "somebody else took the robot")
    await screen.forward(seconds=10)
    assert screen.pose.distance_to(there) < 0.02


async def test_paths_of_older_clients(screen: Screen) -> None:
    await screen.prepare(R101=(1.0, 0.0, "ROOM"))
    assert (await screen.client.get(f"{TASKS}/stage")).json() == await screen.stage()
    await screen.create("R101", "RETURN")
    await screen.forward(seconds=1)
    events = (await screen.client.get(f"{API}/events")).json()
    assert "DELIVERY_TASK_START" in [event["type"] for event in events]
    await screen.client.delete(TASKS)
    await screen.forward(seconds=3)
    motion = "/api/multi-floor/motion/v1"
    target = {"target": {"poi_name": "nowhere"}}
    for path, body, word in (("gohomeaction", None, "BackHome"), ("movetoaction", target, "Move")):
        action = (await screen.client.post(f"{motion}/{path}", json=body)).json()
        assert action["action_name"] == f"slamtec.agent.actions.MultiFloor{word}Action"
    assert (await screen.client.post(f"{motion}/movetoaction", content=b"}")).status_code == 400
