"""Elevators on the map and rides between floors, through a real socket, in the office with its lift."""

from __future__ import annotations

import math

import httpx
import pytest

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.events import FloorReached
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.lift.two_floors import (
    ACTIONS,
    AREAS,
    ELEVATORS,
    FRONT,
    LIFT,
    MULTI,
    SUCCESS,
    area_of,
    drive_to,
    finish,
    on_map,
    start,
    two_floors,
)


async def test_elevators_of_the_map(client: httpx.AsyncClient, forward: Forward, origin: Pose) -> None:
    await forward(seconds=1)
    assert (await client.get(ELEVATORS)).json() == []
    assert (await client.get(f"{ELEVATORS}/{LIFT}")).status_code == 400
    await client.post(AREAS, json=area_of(origin, "2"))
    (elevator,) = (await client.get(ELEVATORS)).json()
    assert (elevator["door_type"], elevator["elevator_id"]) == ("double_doors", LIFT)
    (front,), (rear,) = elevator["front_scheduling_poses"], elevator["rear_scheduling_poses"]
    expected = on_map(Point(FRONT.x + 1.2, FRONT.y), origin)
    assert (front["x"], front["y"]) == pytest.approx((expected.x, expected.y))
    assert math.cos(front["yaw"] + origin.yaw) == pytest.approx(-1)  # west, into the car
    assert math.cos(rear["yaw"] + origin.yaw) == pytest.approx(1)
    assert (await client.get(f"{ELEVATORS}/{LIFT}")).json() == elevator


async def test_relation_of_the_robot_to_elevators(client: httpx.AsyncClient, forward: Forward, origin: Pose) -> None:
    await forward(seconds=1)
    await client.post(AREAS, json=area_of(origin))
    for x, relation in ((1.0, "in_elevator"), (2.1, "close_to_elevator_sill"), (-0.3, "out_of_elevator")):
        here = on_map(Point(x, 10.0), origin)
        await client.put("/api/core/slam/v1/localization/:enable", json={"enable": False})
        await client.put("/api/core/slam/v1/localization/pose", json={"x": here.x, "y": here.y})
        assert (await client.get(f"{ELEVATORS}/{LIFT}/pose_relation")).json() == relation
        inside = relation == "in_elevator"
        assert (await client.get(f"{MULTI}/floors/:current")).json()["elevator"] == (LIFT if inside else "")
    assert (await client.get(f"{ELEVATORS}/unknown/pose_relation")).status_code == 400


@pytest.mark.slow  # a long story; in short: test_into_car_that_others_command_and_out_again
async def test_to_a_place_on_another_floor_and_back(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, origin: Pose
) -> None:
    world.stage.person("person 0 0").place(28.5, 10.5)  # people there would block the way, as PATH_OCCUPIED says
    await forward(seconds=1)
    await drive_to(client, forward, origin, 10.0, 5.0)
    await two_floors(robot, client, origin)
    robot[LiftClient].call(2)  # the car has to come
    await forward(seconds=30)
    await client.get("/api/platform/v1/events")
    walls = "/api/core/artifact/v1/lines/walls"
    wall = {"start": {"x": 30.0, "y": 30.0}, "end": {"x": 31.0, "y": 30.0}}  # out of everyone's way
    assert (await client.post(walls, json=[wall])).status_code == 200
    id = await start(client, "MultiFloorMoveAction", target={"poi_name": "upstairs"})
    ended, stages = await finish(client, forward, id, within=500)
    assert ended == SUCCESS
    assert [stage for stage in stages if "ELEVATOR" in stage] == [
        "GOING_TO_ELEVATOR",
        "WAIT_FOR_ELEVATOR",
        "GOING_INTO_ELEVATOR",
        "IN_ELEVATOR",
        "GOING_OUT_OF_ELEVATOR",
    ]
    assert stages[-1] == "GOING_TO_TARGET"
    assert world.truth.floor_of("a") == 1
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "first"
    assert (await client.get(walls)).json() == []
    assert world.truth.pose_of("a").distance_to(Point(6.0, 10.0)) < 0.5
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert [event for event in events if "ELEVATOR" in event] == [
        "WAIT_ELEVATOR",
        "ENTER_ELEVATOR_PATH_FOUND",
        "ENTER_ELEVATOR",
        "IN_ELEVATOR",
        "LEAVE_ELEVATOR",
        "OUT_OF_ELEVATOR",
    ]
    assert "PATH_OCCUPIED" not in events
    goal = on_map(Point(5.0, 10.0), origin)
    target = {"building": "A", "floor": "ground", "pose": {"x": goal.x, "y": goal.y, "yaw": 0}}
    id = await start(client, "MultiFloorMoveAction", target=target)
    assert (await finish(client, forward, id, within=500))[0] == SUCCESS
    assert world.truth.floor_of("a") == 0
    assert len((await client.get(walls)).json()) == 1  # the drawings from before the ride are back
    assert world.truth.pose_of("a").distance_to(Point(5.0, 10.0)) < 0.3
    await client.get("/api/platform/v1/events")
    world.faults.inject("lift_out_of_service")
    id = await start(client, "MultiFloorMoveAction", target={"poi_name": "upstairs"})
    ended, _ = await finish(client, forward, id)
    assert (ended["result"], ended["reason"]) == (-1, "the lift is out of service")
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert [event for event in events if "ELEVATOR" in event] == ["WAIT_ELEVATOR", "ENTER_ELEVATOR_FAILED"]
    assert world.truth.floor_of("a") == 0


async def test_loaded_places_follow_the_moved_origin(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, origin: Pose
) -> None:
    """A place of the floor in memory stays where it is in the world; those of other floors keep their numbers."""

    async def places() -> list[tuple[float, float]]:
        docks = (await client.get(f"{MULTI}/homedocks")).json()
        pois = (await client.get(f"{MULTI}/pois")).json()
        return [(place["pose"]["x"], place["pose"]["y"]) for place in (*docks, *pois)]

    await forward(seconds=1)
    await two_floors(robot, client, origin)
    dock, down, up = await places()
    new = {"new_origin": {"x": 1.0, "y": -2.0}}
    assert (await client.put("/api/core/slam/v1/maps/origin", json=new)).status_code == 200
    moved = [pytest.approx((x - 1.0, y + 2.0)) for x, y in (dock, down)]
    assert await places() == [*moved, up]
    await client.put("/api/multi-floor/localization/v1/pose", json={"poi_name": "downstairs"})
    assert (robot[Localization].pose.x, robot[Localization].pose.y) == moved[1]
    assert (await client.delete("/api/core/slam/v1/maps")).status_code == 200  # a new map begins at that place
    (_, cleared, still) = await places()
    assert (cleared, still) == (pytest.approx((0.0, 0.0), abs=1e-6), up)


async def test_unloaded_floor_shows_no_other_one(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, origin: Pose
) -> None:
    """The robot was brought there by a car in which a ride was given up."""

    async def brought_to(floor: int) -> tuple[str, str, list[str]]:
        robot.events.publish(FloorReached(stamp=robot.clock.time(), floor=floor, place=Pose(0.1)))
        await forward(seconds=0.5)
        here = (await client.get(f"{MULTI}/floors/:current")).json()
        places = (await client.get("/api/core/artifact/v1/pois")).json()
        return here["building"], here["floor"], [place["id"] for place in places]

    await forward(seconds=1)
    await two_floors(robot, client, origin)
    assert await brought_to(2) == ("A", "second", [])
    (elevator,) = (await client.get(ELEVATORS)).json()  # the car in which it stands is all that it knows there
    assert elevator["elevator_id"] == LIFT
    (front,) = elevator["front_scheduling_poses"]
    assert [front[key] for key in ("x", "y", "yaw")] == pytest.approx([-2.1, 0.0, 0.0], abs=1e-6)
    assert await brought_to(1) == ("A", "first", ["u1"])
    assert await brought_to(0) == ("A", "ground", ["g1"])


async def test_unknown_place_fails_the_action(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    id = await start(client, "MultiFloorMoveAction", target={"poi_name": "nowhere"})
    ended, _ = await finish(client, forward, id)
    assert (ended["result"], ended["reason"]) == (-1, "POI not found")
    body = {"action_name": "agent.actions.MultiFloorMoveAction", "options": {"target": {"x": 1, "y": 2}}}
    assert (await client.post(ACTIONS, json=body)).status_code == 400
    body = {"action_name": "agent.actions.EnterElevatorAction", "options": {"elevator_id": "unknown"}}
    assert (await client.post(ACTIONS, json=body)).status_code == 400


@pytest.mark.slow  # in short: test_robot_rides_to_second_floor_and_drives_out
async def test_into_car_that_others_command_and_out_again(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, origin: Pose
) -> None:
    await forward(seconds=1)
    goal = on_map(Point(5.0, 10.0), origin)
    await drive_to(client, forward, origin, 5.0)
    await client.post(AREAS, json=area_of(origin))
    robot[LiftClient].hold_door(120.0)
    await forward(seconds=5)
    id = await start(client, "EnterElevatorAction", elevator_id=LIFT, enter_elevator_options={"timeout_in_ms": 90_000})
    ended, _ = await finish(client, forward, id)
    assert ended == SUCCESS
    assert world.truth.pose_of("a").distance_to(Point(0.95, 10.0)) < 0.2
    assert math.cos(world.truth.pose_of("a").yaw) > 0.99  # facing the front door
    assert (await client.get(f"{ELEVATORS}/{LIFT}/pose_relation")).json() == "in_elevator"
    assert (await client.post(f"{MULTI}/pois/:search_nearby")).json()["name"] == "IN_ELEVATOR"
    robot[LiftClient].hold_door(120.0)
    options = {"if_need_reach_milestone": True}
    target = {"x": goal.x, "y": goal.y, "yaw": 0}
    id = await start(client, "LeaveElevatorAction", elevator_id=LIFT, target=target, leave_elevator_options=options)
    ended, _ = await finish(client, forward, id)
    assert ended == SUCCESS
    assert world.truth.pose_of("a").distance_to(Point(5.0, 10.0)) < 0.3
    assert (await client.get(f"{ELEVATORS}/{LIFT}/pose_relation")).json() == "out_of_elevator"
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert [event for event in events if "ELEVATOR" in event] == [
        "WAIT_ELEVATOR",
        "ENTER_ELEVATOR",
        "IN_ELEVATOR",
        "TURNING_ROUND_IN_ELEVATOR",
        "LEAVE_ELEVATOR",
        "OUT_OF_ELEVATOR",
    ]


async def stand_in(client: httpx.AsyncClient, world: World, forward: Forward, place: Pose) -> None:
    """Put the robot, without any map, to ``place`` in the world, with the car's area on a new map around it."""
    world.stage.person("person 0 0").place(28.5, 10.5)  # out of the way
    await forward(seconds=1)
    world.stage.place("a", place)
    assert (await client.delete("/api/core/slam/v1/maps")).status_code == 200
    assert (await client.post(AREAS, json=area_of(place))).status_code == 200
    await forward(seconds=2)


@pytest.mark.parametrize(
    ("limit", "blocked", "reason"),
    [
        ({}, True, "CANNOT_REACH_TARGET"),
        ({"search_path_timeout_in_ms": 5000}, True, "no path out of the elevator was found in time"),
        ({"arrive_door_timeout_in_ms": 300}, False, "the robot did not reach the elevator's door in time"),
        ({"on_elevator_door_timeout_in_ms": 200}, False, "PATH_OCCUPIED"),
        (dict.fromkeys(("search_path_timeout_in_ms", "arrive_door_timeout_in_ms"), 30_000), False, ""),
        ({"on_elevator_door_timeout_in_ms": 30_000}, False, ""),
    ],
)
async def test_leaving_is_given_up_at_each_limit(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward,
    limit: dict[str, int], blocked: bool, reason: str,
) -> None:  # fmt: skip
    await stand_in(client, world, forward, Pose(0.95, 10.0))
    robot[LiftClient].hold_door(60.0)
    if blocked:
        world.stage.add_obstacle(Pose(2.1, 10.0), (0.3, 1.6, 1.0))
    await forward(seconds=5)
    await client.get("/api/platform/v1/events")
    id = await start(client, "LeaveElevatorAction", elevator_id=LIFT, leave_elevator_options=limit)
    ended, _ = await finish(client, forward, id, within=40)
    assert ended == {"status": 4, "result": -1 if reason else 0, "reason": reason}
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert ("LEAVE_ELEVATOR_FAILED" in events, "OUT_OF_ELEVATOR" in events) == (bool(reason), not reason)


async def test_path_out_of_car_is_searched_until_limit(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await stand_in(client, world, forward, Pose(0.95, 10.0))
    robot[LiftClient].hold_door(60.0)
    box = world.stage.add_obstacle(Pose(2.1, 10.0), (0.3, 1.6, 1.0))
    await forward(seconds=5)
    limit = {"search_path_timeout_in_ms": 40_000}
    id = await start(client, "LeaveElevatorAction", elevator_id=LIFT, leave_elevator_options=limit)
    await forward(seconds=10)
    world.stage.remove_obstacle(box)
    assert (await finish(client, forward, id, within=60))[0] == SUCCESS


@pytest.mark.parametrize(("options", "x"), [({}, 0.95), ({"use_conservative_mode": False}, 0.6)])
async def test_robot_squeezes_in_if_asked(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, options: dict[str, bool], x: float
) -> None:
    await stand_in(client, world, forward, Pose(3.2, 10.0, math.pi))
    robot[LiftClient].hold_door(120.0)
    await forward(seconds=5)
    id = await start(client, "EnterElevatorAction", elevator_id=LIFT, enter_elevator_options=options)
    ended, _ = await finish(client, forward, id, within=60)
    assert ended == SUCCESS
    assert world.truth.pose_of("a").distance_to(Point(x, 10.0)) < 0.12


@pytest.mark.slow  # a long story; the rides above have its parts
async def test_orders_on_two_floors_and_the_dock_below(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, origin: Pose
) -> None:
    await forward(seconds=1)
    await drive_to(client, forward, origin, 10.0, 5.0)
    await two_floors(robot, client, origin)
    tasks = "/api/delivery/v1/tasks"
    wanted = [
        {"location": {"poi_name": name, "task_points": []}, "type": "RETURN"}
        for name in ("downstairs", "upstairs", "g1")
    ]
    wanted.append({"location": {"poi_name": "nowhere", "task_points": []}, "type": "RETURN"})
    assert (await client.post(f"{tasks}/:batch", json=wanted)).json()["result"] is False
    numbers = (await client.post(f"{tasks}/:batch", json=wanted[:3])).json()["order_ids"]
    seen: list[tuple[str, str, str]] = []
    floors: dict[str, int] = {}
    for _ in range(700):
        await forward(seconds=1)
        stage = (await client.get("/api/delivery/v1/stage")).json()
        now = (stage["stage"], stage.get("milestone", ""), stage.get("target_floor", ""))
        if not seen or seen[-1] != now:
            seen.append(now)
        for task in (await client.get(tasks, params={"status": "all"})).json():
            if task["status"] == "SUCCEEDED":
                floors.setdefault(task["task"]["order_id"], world.truth.floor_of("a"))
        if stage["stage"] == "GOING_HOME":
            break
    assert floors == {numbers[0]: 0, numbers[1]: 1, numbers[2]: 0}, seen
    for milestone in ("GOING_TO_ELEVATOR", "GOING_INTO_ELEVATOR", "IN_ELEVATOR", "GOING_OUT_OF_ELEVATOR"):
        assert ("ON_DELIVERING", milestone, "first") in seen
        assert ("ON_DELIVERING", milestone, "ground") in seen
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert [event for event in events if event in ("WAIT_ELEVATOR", "OUT_OF_ELEVATOR", "DELIVERY_TASK_START")] == [
        "DELIVERY_TASK_START",
        *("DELIVERY_TASK_START", "WAIT_ELEVATOR", "OUT_OF_ELEVATOR") * 2,
    ]
    assert world.truth.pose_of("a").distance_to(Point(8.0, 10.0)) < 1.0
    assert (await client.get(f"{MULTI}/floors/:current")).json()["floor"] == "ground"


@pytest.mark.slow  # a long story; the rides above have its parts
async def test_home_from_the_other_floor_after_an_order(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, origin: Pose
) -> None:
    await forward(seconds=1)
    await drive_to(client, forward, origin, 10.0, 5.0)
    await two_floors(robot, client, origin)
    order = {"location": {"poi_name": "upstairs", "task_points": []}, "type": "RETURN"}
    assert (await client.post("/api/delivery/v1/tasks", json=order)).json()["result"] is True
    for _ in range(30):
        await forward(seconds=1)
        if (await client.get("/api/delivery/v1/stage")).json().get("milestone") == "GOING_TO_ELEVATOR":
            break
    execution = "/api/delivery/v1/tasks/:task_execution"
    await client.put(execution, json={"enable_task_execution": False})  # a person uses the screen
    await forward(seconds=3)
    held = world.truth.pose_of("a")
    await forward(seconds=20)
    assert world.truth.pose_of("a").distance_to(held) < 0.02
    (task,) = (await client.get("/api/delivery/v1/tasks")).json()
    assert task["result"]["stage"] == "GOING_TO_ELEVATOR"
    await client.put(execution, json={"enable_task_execution": True})
    stages = []
    for _ in range(700):
        await forward(seconds=1)
        stage = (await client.get("/api/delivery/v1/stage")).json()
        stages.append((stage["stage"], stage.get("milestone", ""), stage.get("target_floor", "")))
        if stage["stage"] == "IDLE":
            break
    assert ("GOING_HOME", "IN_ELEVATOR", "ground") in stages
    assert robot[DockContact].docked, (stages[-5:], world.truth.pose_of("a"))
    assert world.truth.floor_of("a") == 0
