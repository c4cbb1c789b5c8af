"""Cars whose only door is the rear one: the area's centre line ends at the door."""

from __future__ import annotations

import math

import httpx
import pytest

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.lift.two_floors import (
    AREAS,
    ELEVATORS,
    LIFT,
    SUCCESS,
    area_of,
    finish,
    map_two_floors,
    start,
)


async def test_ride_uses_rear_door(robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    await map_two_floors(robot, client, world, forward, doors="1")
    for place, floor, x in (("upstairs", 1, 6.0), ("downstairs", 0, 8.0)):
        ride = await start(client, "MultiFloorMoveAction", target={"poi_name": place})
        assert (await finish(client, forward, ride))[0] == SUCCESS
        assert world.truth.floor_of("a") == floor
        assert world.truth.pose_of("a").distance_to(Point(x, 10.0)) < 0.5


@pytest.mark.parametrize("doors", ["1", "2"])
async def test_car_is_crossed_by_rear_door(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, doors: str
) -> None:
    world.stage.person("person 0 0").place(28.5, 10.5)  # out of the way
    await forward(seconds=1)
    place = Pose(3.2, 10.0, math.pi)
    world.stage.place("a", place)
    assert (await client.delete("/api/core/slam/v1/maps")).status_code == 200
    area = area_of(place, "1")
    area["metadata"]["elevator_door_type"] = doors
    assert (await client.post(AREAS, json=area)).status_code == 200
    await forward(seconds=2)
    robot[LiftClient].hold_door(120.0)
    await forward(seconds=5)
    options = {"elevator_door_flag": "rear_door"}
    stop = {"elevator_stopping_yaw": "face_to_rear_door"}
    id = await start(client, "EnterElevatorAction", elevator_id=LIFT, enter_elevator_options=options | stop)
    assert (await finish(client, forward, id, within=60))[0] == SUCCESS
    assert world.truth.pose_of("a").distance_to(Point(0.95, 10.0)) < 0.12
    assert math.cos(world.truth.pose_of("a").yaw) > 0.99  # facing the door
    robot[LiftClient].hold_door(120.0)
    id = await start(client, "LeaveElevatorAction", elevator_id=LIFT, leave_elevator_options=options)
    assert (await finish(client, forward, id, within=60))[0] == SUCCESS
    assert (await client.get(f"{ELEVATORS}/{LIFT}/pose_relation")).json() == "out_of_elevator"
    assert world.truth.pose_of("a").distance_to(Point(2.95, 10.0)) < 0.2
