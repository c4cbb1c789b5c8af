"""Actions that are made of several, through a real socket: going home in other ways, parking, finding oneself."""

from __future__ import annotations

import itertools
import math
from typing import Any

import httpx
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.client_context import set_client
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.logistics.jack import Jack, JackStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.lease import Lease
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.motion.errands import PART, Errand, run_errand
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose

pytestmark = pytest.mark.world("empty")
MOTION, MULTI = "/api/core/motion/v1", "/api/multi-floor/map/v1"
ACTIONS = f"{MOTION}/actions"
SUCCESS = {"status": 4, "result": 0, "reason": ""}


async def start(client: httpx.AsyncClient, name: str, **options: object) -> int:
    body = {"action_name": f"slamtec.agent.actions.{name}", "options": options}
    reply = await client.post(ACTIONS, json=body)
    assert reply.status_code == 200, reply.text
    return int(reply.json()["action_id"])


async def state(client: httpx.AsyncClient, id: int) -> Any:
    return (await client.get(f"{ACTIONS}/{id}")).json()["state"]


async def finish(client: httpx.AsyncClient, forward: Forward, id: int, *, within: float = 120.0) -> Any:
    for _ in range(int(within * 2)):
        if (found := await state(client, id))["status"] == 4:
            return found
        await forward(seconds=0.5)
    raise AssertionError(f"action {id} has not ended within {within} s")


async def test_errand_that_waits_ends_with_its_map(client: httpx.AsyncClient, forward: Forward) -> None:
    """It waits until the one before has braked; on the new map, its goal is elsewhere."""
    await forward(seconds=1)
    for x in (3.0, 1.0):
        id = await start(client, "MultiFloorMoveAction", target={"pose": {"x": x, "y": 1.0, "yaw": 0.0}})
        await forward(seconds=2 if x == 3.0 else 0)
    assert (await client.delete("/api/core/slam/v1/maps")).status_code == 200
    ended = await finish(client, forward, id, within=30.0)
    assert (ended["result"], ended["reason"]) == (-1, "CANNOT_REACH_TARGET")


async def test_errand_paused_between_parts_stays_paused(robot: Robot, forward: Forward) -> None:
    """The next part drove off."""

    async def work(errand: Errand) -> None:
        await robot.clock.sleep(2.0)
        await errand.do(robot[Driving].move_by(Pose(0.5), source=PART))

    action = run_errand(robot, "wait, then drive", work)
    await forward(seconds=1)
    action.pause()
    await forward(seconds=4)
    assert action.paused
    assert robot[Localization].pose.distance_to(Pose()) < 0.02
    action.resume()
    await forward(seconds=5)
    assert action.status is ActionStatus.SUCCEEDED


async def test_going_home_without_docking_ends_at_landing_point(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    id = await start(client, "MoveToAction", target={"x": 2.0, "y": 1.0})
    assert await finish(client, forward, id) == SUCCESS
    id = await start(client, "GoHomeAction", gohome_options={"flags": "no_dock"})
    await forward(seconds=2)
    current = (await client.get(f"{ACTIONS}/:current")).json()
    assert (current["action_id"], current["stage"]) == (id, "GOING_TO_LANDING_POINT")
    assert len((await client.get(f"{MOTION}/path")).json()["path_points"]) >= 2
    assert (await client.get(f"{MOTION}/time")).json() > 0
    assert await finish(client, forward, id) == SUCCESS
    assert not robot[DockContact].docked
    assert_pose(robot[Localization].pose, x=0.6, y=0.0, deg=0, within=0.1, within_deg=4)
    assert (await client.get(f"{ACTIONS}/:current")).status_code == 404


async def test_current_action_is_new_while_old_one_brakes(
    client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    world.stage.place("a", Pose(5.0, 5.0))
    await client.put("/api/core/slam/v1/localization/pose", json={"x": 5.0 - 0.375, "y": 0})
    await forward(seconds=1)
    home = await start(client, "GoHomeAction")
    await forward(seconds=2)
    away = await start(client, "MoveToAction", target={"x": 6.0, "y": 1.0})
    assert (await state(client, home))["status"] == 1
    assert (await client.get(f"{ACTIONS}/:current")).json()["action_id"] == away
    await client.delete(f"{ACTIONS}/:current")
    await forward(seconds=2)
    assert (await client.get(f"{ACTIONS}/:current")).status_code == 404
    assert [(await state(client, id))["result"] for id in (home, away)] == [-2, -2]


async def test_docked_robot_stays_if_it_need_not_dock(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    id = await start(client, "GoHomeAction", gohome_options={"flags": "no_dock"})
    assert await finish(client, forward, id, within=2) == SUCCESS
    assert robot[DockContact].docked


@pytest.mark.slow  # in short: test_a_bound_dock_that_is_gone_is_reported
async def test_back_to_landing_point_when_dock_is_gone(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    world.stage.place("a", Pose(5.0, 5.0))
    await client.put("/api/core/slam/v1/localization/pose", json={"x": 0, "y": 0})
    await forward(seconds=1)
    await client.put("/api/core/slam/v1/homepose", json={"x": 1.0, "y": 0.0, "yaw": 0.0})
    id = await start(client, "GoHomeAction", gohome_options={"flags": "dock", "back_to_landing": True})
    ended = await finish(client, forward, id, within=300)
    assert (ended["result"], ended["reason"]) == (-1, "SEARCH_DOCK_FAILED")
    assert_pose(robot[Localization].pose, x=1.6, y=0.0, within=0.15)
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert events.count("SEARCH_DOCK_FAILED") == 1


async def test_stop_button_and_who_takes_wheels_end_errand(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    for stop in ("button", "new action", "someone else"):
        id = await start(client, "MoveToAction", target={"x": 2.5, "y": 1.0})
        await finish(client, forward, id)
        id = await start(client, "GoHomeAction")
        await forward(seconds=1)
        if stop == "button":
            await client.delete(f"{ACTIONS}/:current")
        elif stop == "new action":
            await start(client, "RotateAction", angle=0.5)
        else:
            robot[Driving].drive(Twist(), lifetime=0.1, source="someone else")
        await forward(seconds=3)
        ended = await state(client, id)
        assert (ended["status"], ended["result"]) == (4, -2), stop
        assert (await client.get(f"{ACTIONS}/:current")).status_code == 404
        assert robot[Base].velocity.speed < 0.01


async def test_path_points_are_followed(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    points = [(1.0, 0.0), (1.0, 1.5), (2.5, 1.5)]
    id = await start(client, "FollowPathPointsAction", path_points=[{"x": x, "y": y} for x, y in points])
    nearest = dict.fromkeys(points, math.inf)
    for _ in range(240):
        for point in points:
            nearest[point] = min(nearest[point], robot[Localization].pose.distance_to(Point(*point)))
        if (await state(client, id))["status"] == 4:
            break
        await forward(seconds=0.25)
    assert await state(client, id) == SUCCESS
    assert max(nearest.values()) < 0.3


async def test_sweeping_covers_the_area(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    area = {"start": {"x": 1.0, "y": 0.0}, "end": {"x": 2.5, "y": 0.0}, "half_width": 0.8}
    await client.post("/api/core/artifact/v1/rectangle-areas/coverage_area", json={"area": area, "metadata": {}})
    (drawn,) = (await client.get("/api/core/artifact/v1/rectangle-areas/coverage_area")).json()
    id = await start(client, "SweepAction", sweep_options={"region_ids": [drawn["id"]], "spacing": 0.5})
    await forward(seconds=1)
    assert (await client.get(f"{ACTIONS}/:current")).json()["action_name"].endswith("SweepAction")
    been: list[Pose] = []
    for _ in range(400):
        been.append(robot[Localization].pose)
        if (await state(client, id))["status"] == 4:
            break
        await forward(seconds=0.25)
    assert await state(client, id) == SUCCESS
    for x, y in ((1.2, -0.5), (1.2, 0.5), (2.3, -0.5), (2.3, 0.5)):
        assert min(pose.distance_to(Point(x, y)) for pose in been) < 0.4


async def test_parking_at_the_nearest_place_of_that_type(
    robot: Robot, client: httpx.AsyncClient, forward: Forward
) -> None:
    await forward(seconds=1)
    for name, x, y, kind in (("far", 3.0, 2.0, "PARKING"), ("near", 2.0, 0.5, "PARKING"), ("desk", 1.0, 0.0, "")):
        pose = {"x": x, "y": y, "yaw": 1.0}
        entry = {"id": name, "pose": pose, "metadata": {"display_name": name, "type": kind}}
        await client.post("/api/core/artifact/v1/pois", json=entry)
    assert (await client.post(f"{MULTI}/stcm/:sync")).status_code == 200
    id = await start(client, "ReturnToParkingAction")
    assert await finish(client, forward, id) == SUCCESS
    assert_pose(robot[Localization].pose, x=2.0, y=0.5, deg=math.degrees(1.0), within=0.1, within_deg=4)
    id = await start(client, "ReturnToParkingAction", target={"poi_name": "far"})
    assert await finish(client, forward, id) == SUCCESS
    assert_pose(robot[Localization].pose, x=3.0, y=2.0, within=0.1)
    id = await start(client, "ReturnToParkingAction", target={"poi_name": "nowhere"})
    ended = await finish(client, forward, id)
    assert (ended["result"], ended["reason"]) == (-1, "POI not found")


@pytest.mark.world("office")
@pytest.mark.parametrize("move", ["NoMove", pytest.param("RotateOnly", marks=pytest.mark.slow)])
async def test_a_carried_robot_finds_itself(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward, move: str
) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    id = await start(client, "MoveToAction", target={"x": 2.0, "y": 0.0})
    await finish(client, forward, id)
    await client.put("/api/core/slam/v1/localization/pose", json={"x": 0.5, "y": 0.7, "yaw": 1.0})
    options = {
        "area": {"x": -1.0, "y": -2.0, "width": 5.0, "height": 4.0},
        "relocalization_options": {"max_recover_time": 60_000, "recover_movement_type": move},
    }
    id = await start(client, "RecoverLocalizationAction", **options)
    assert await finish(client, forward, id) == SUCCESS
    true = world.truth.pose_of("a").relative_to(origin)
    assert robot[Localization].pose.distance_to(true) < 0.2


@pytest.mark.world("office")
@pytest.mark.parametrize(("move", "turns"), [("NoMove", False), ("RotateOnly", True)])
async def test_recovery_gives_up_in_time_turning_if_allowed(
    client: httpx.AsyncClient, forward: Forward, robot: Robot, world: World, move: str, turns: bool
) -> None:
    await forward(seconds=1)
    id = await start(client, "MoveToAction", target={"x": 1.0, "y": 0.0})
    await finish(client, forward, id)
    before = world.truth.pose_of("a")
    options = {
        "area": {"x": 500.0, "y": 500.0, "width": 1.0, "height": 1.0},
        "relocalization_options": {"max_recover_time": 15_000, "recover_movement_type": move},
    }
    id = await start(client, "RecoverLocalizationAction", **options)
    await forward(seconds=12)
    current = (await client.get(f"{ACTIONS}/:current")).json()
    assert (current["action_id"], current["action_name"][-25:]) == (id, "RecoverLocalizationAction")
    await forward(seconds=5)
    ended = await state(client, id)
    assert (ended["status"], ended["result"], ended["reason"]) == (4, -1, "LOCALIZATION_LOST")
    turned = abs(math.degrees(world.truth.pose_of("a").yaw - before.yaw))
    assert turned > 20 if turns else turned < 1
    assert robot[Base].velocity.speed < 0.01


@pytest.mark.parametrize("name", ["RecoverLocalizationAction", "ManualRelocalizationAction"])
async def test_refused_search_stops_no_other_client(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, name: str
) -> None:
    """A client without control stopped the one that has it, and was refused then."""
    await robot[Lease].take("the one in control")
    set_client("the one in control")
    drive = robot[Driving].drive(Twist(0.1), source="test")
    await forward(seconds=1)
    reply = await client.post(ACTIONS, json={"action_name": f"slamtec.agent.actions.{name}", "options": {}})
    assert reply.status_code == 400
    await forward(seconds=1)
    assert drive.status is ActionStatus.EXECUTING


@pytest.mark.parametrize("name", ["RecoverLocalizationAction", "ManualRelocalizationAction"])
async def test_search_that_finds_several_places_lets_time_pass(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """It polled for ever within one instant: in lockstep the world stood still."""
    looks = itertools.count(1)

    async def several(_localization: object, _region: object) -> tuple[list[None], Pose]:
        assert next(looks) < 100
        return [None, None], Pose()

    await forward(seconds=1)
    monkeypatch.setattr(type(robot[Localization]), "_look", several)
    id = await start(client, name, relocalization_options={"max_recover_time": 5_000})
    await forward(seconds=6)
    assert next(looks) < 20
    if name == "RecoverLocalizationAction":
        assert await state(client, id) == {"status": 4, "result": -1, "reason": "LOCALIZATION_LOST"}


@pytest.mark.world("office")
async def test_pushed_robot_knows_its_place_on_the_dock(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    assert robot[DockContact].docked
    await client.put("/api/core/slam/v1/localization/pose", json={"x": 40.0, "y": 40.0})
    id = await start(client, "ManualRelocalizationAction")
    assert await finish(client, forward, id, within=20) == SUCCESS
    assert robot[Localization].pose.distance_to(Pose()) < 0.2
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert events.count("RESET_MAP_TO_DOCK") == 1


async def test_a_bound_dock_that_is_gone_is_reported(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    await client.get("/api/platform/v1/events")
    await robot[Settings].put("slamware.home_dock", "a dock that was")
    await start(client, "GoHomeAction")
    await forward(seconds=1)
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert events == ["DOCK_ID_NOT_FOUND"]


async def test_a_careful_strategy_is_slower(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    url = f"{MOTION}/strategies"
    assert "default" in (await client.get(url)).json()
    assert (await client.get(f"{url}/:current")).json() == "default"
    fastest = {}
    for strategy, x in (("default", 4.0), ("careful", 1.0)):
        assert (await client.put(f"{url}/:current", json={"strategy": strategy})).json() is True
        assert (await client.get(f"{url}/:current")).json() == strategy
        await start(client, "MoveToAction", target={"x": x, "y": 0.0})
        speeds = []
        for _ in range(60):
            await forward(seconds=0.2)
            speeds.append(robot[Base].velocity.speed)
        fastest[strategy] = max(speeds)
    assert fastest["careful"] < 0.7 * fastest["default"]
    assert (await client.put(f"{url}/:current", json={"strategy": "reckless"})).status_code == 400


@pytest.mark.parametrize(("strategy", "ratio"), [("careful", 0), ("default", 0.5)])
async def test_way_home_is_as_slow_as_asked(
    robot: Robot, client: httpx.AsyncClient, forward: Forward, strategy: str, ratio: float
) -> None:
    await forward(seconds=1)
    id = await start(client, "MoveToAction", target={"x": 3.0, "y": 0.0})
    await finish(client, forward, id)
    await client.put(f"{MOTION}/strategies/:current", json={"strategy": strategy})
    id = await start(client, "GoHomeAction", gohome_options={"move_options": {"mode": 0, "speed_ratio": ratio}})
    fastest = 0.0
    while (await state(client, id))["status"] != 4:
        await forward(seconds=0.2)
        fastest = max(fastest, abs(robot[Base].velocity.x))
    assert await state(client, id) == SUCCESS
    assert robot[DockContact].docked
    assert fastest < 0.7  # m/s; without either, 1.2


async def test_the_jack_as_an_action(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    id = await start(client, "JackMoveAction", move_direction="Up")
    assert (await client.get(f"{ACTIONS}/:current")).json()["action_id"] == id
    assert await finish(client, forward, id) == SUCCESS
    assert robot[Jack].stage is JackStage.UP


async def test_errands_replace_drives_from_the_start(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    """The jack rises first: the robot does not drive to its earlier goal meanwhile."""
    await forward(seconds=1)
    here = robot[Localization].pose
    before = await start(client, "MoveToAction", target={"x": here.x + 3.0, "y": here.y})
    await forward(seconds=2)
    id = await start(client, "JackTopMoveToAction", target={"x": here.x, "y": here.y})
    await forward(seconds=1)
    assert await state(client, before) == {"status": 4, "result": -2, "reason": "carry took over"}
    assert (robot[Base].velocity, robot[Jack].stage) == (Twist(), JackStage.MOVING)
    assert (await client.get(f"{ACTIONS}/:current")).json()["action_id"] == id


async def test_lifted_shelf_is_carried_to_a_place(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    here = robot[Localization].pose
    goal = here.compose(Pose(1.0, 0.0))
    place = {"id": "shelf", "pose": {"x": goal.x, "y": goal.y, "yaw": 0.0}, "metadata": {"display_name": "shelf"}}
    assert (await client.post("/api/core/artifact/v1/pois", json=place)).status_code == 200
    slowly = {"robot_line_speed": 0.3}
    before = world.truth.pose_of("a")
    id = await start(client, "JackTopMoveToAction", target={"poi_name": "shelf"}, modify_params_move_options=slowly)
    fastest = 0.0
    while (await client.get(f"{ACTIONS}/{id}")).json()["state"]["status"] != 4:
        await forward(seconds=0.5)
        fastest = max(fastest, robot[Odometry].reading.twist.x)
    assert (await client.get(f"{ACTIONS}/{id}")).json()["state"] == SUCCESS
    assert robot[Jack].stage is JackStage.UP
    assert world.truth.pose_of("a").distance_to(before) == pytest.approx(1.0, abs=0.1)
    assert 0.1 < fastest < 0.35
    body = {"action_name": "JackTopMoveToAction", "options": {"target": {"poi_name": "nowhere"}}}
    assert (await client.post(ACTIONS, json=body)).status_code == 400
