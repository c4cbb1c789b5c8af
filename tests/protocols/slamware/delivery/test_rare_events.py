"""Rare events, each by its cause in the world: narrow, occupied, no current, lost; and the voice."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import httpx
import pytest

from roboglot.model.actions import Action
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.mapping.floors import RideStage
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.errors import Blocked, Expired, Unreachable
from roboglot.model.events import Spoke
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.slamware.screen import API, Screen

ACTIONS, EVENTS = "/api/core/motion/v1/actions", "/api/platform/v1/events"
ALLEY = str(Path(__file__).parents[1] / "data" / "alley.toml")


async def new_events(client: httpx.AsyncClient) -> list[str]:
    return [event["type"] for event in (await client.get(EVENTS)).json()]


async def move(client: httpx.AsyncClient, x: float, y: float) -> None:
    options = {"target": {"x": x, "y": y}}
    reply = await client.post(ACTIONS, json={"action_name": "agent.actions.MoveToAction", "options": options})
    assert reply.status_code == 200


@pytest.mark.slow  # a long story
@pytest.mark.world(ALLEY)
async def test_a_narrow_corridor_is_reported_once_each_way(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    origin = world.truth.pose_of("a")
    for x in (10.0, 2.0):
        goal = Pose(x, 3.0).relative_to(origin)
        await move(client, goal.x, goal.y)
        await forward(seconds=30)
        assert world.truth.pose_of("a").distance_to(Point(x, 3.0)) < 0.3
        assert (await new_events(client)).count("PASS_THE_NARROW_CORRIDOR") == 1


@pytest.mark.world("empty")
async def test_no_corridor_in_a_hall(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    await move(client, 3.0, 1.0)
    await forward(seconds=12)
    events = await new_events(client)
    assert "PASS_THE_NARROW_CORRIDOR" not in events
    assert "CURRENT_POSE_OCCUPIED" not in events


@pytest.mark.world("empty")
@pytest.mark.parametrize("what", ["forbidden area", "wall"])
async def test_someone_drew_over_the_robot(client: httpx.AsyncClient, forward: Forward, what: str) -> None:
    await forward(seconds=1)
    start, end = {"x": -0.5, "y": 0.0}, {"x": 0.5, "y": 0.0}
    artifact = "/api/core/artifact/v1"
    if what == "wall":
        await client.post(f"{artifact}/lines/walls", json=[{"id": 0, "start": start, "end": end, "metadata": {}}])
    else:
        area = {"area": {"start": start, "end": end, "half_width": 0.4}, "metadata": {}}
        await client.post(f"{artifact}/rectangle-areas/forbidden_area", json=area)
    await new_events(client)
    await move(client, 3.0, 1.0)
    await forward(seconds=2)
    assert (await new_events(client)).count("CURRENT_POSE_OCCUPIED") == 1


@pytest.mark.world("empty")
async def test_a_dock_without_current(robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    await forward(seconds=1)
    world.faults.inject("dock_dead", "a")
    world.faults.inject("low_battery", "a", charge=0.5)
    await forward(seconds=15)
    assert (await new_events(client)).count("CHARGING_BASE_FAILED") == 1
    assert (await client.get("/api/core/system/v1/power/status")).json()["isCharging"] is False
    await forward(seconds=60)
    assert "CHARGING_BASE_FAILED" not in await new_events(client)
    world.faults.clear()
    await forward(seconds=5)
    assert "START_CHARGING" in await new_events(client)


@pytest.mark.world("office", body="hermes")
@pytest.mark.slow  # a long story
@pytest.mark.parametrize("helped_by", ["reset", "pose", "dock"])
async def test_a_lost_robot_lets_orders_wait(
    screen: Screen, robot: Robot, world: World, forward: Forward, monkeypatch: pytest.MonkeyPatch, helped_by: str
) -> None:
    # it does not localize itself
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: [])
    await screen.prepare(R101=(3.0, 0.0, "ROOM"), R102=(0.8, 0.0, "ROOM"))
    await forward(seconds=3)
    first = await screen.create("R101", "RETURN")
    await forward(seconds=3)
    localization: Any = robot[Localization]
    slam = "/api/core/slam/v1/localization"
    await screen.client.put(f"{slam}/pose", json={"x": 60.0, "y": 60.0, "yaw": 1.0})  # a wrong confirmation
    await forward(seconds=1)
    for _ in range(60):
        await forward(seconds=1)
        if "LOCALIZATION_ANOMALY" in await screen.events():
            break
    else:
        raise AssertionError(f"not lost: {await screen.task(first)} {localization.quality}")
    assert (await screen.task(first))["result"]["reason"] == "LOCALIZATION_LOST"
    second = await screen.create("R102", "RETURN")
    await forward(seconds=10)
    assert (await screen.task(second))["status"] == "READY"
    here = world.truth.pose_of("a").relative_to(screen.origin)
    match helped_by:
        case "dock":
            world.stage.place("a", screen.origin)
        case "pose":
            await screen.client.put(f"{slam}/pose", json={"x": here.x, "y": here.y, "yaw": here.yaw})
        case _:
            localization.enable(False)  # otherwise it would notice that it is lost before it begins
            localization.set_pose(here)
            localization.enable(True)
            assert (await screen.client.post(f"{slam}/status/:reset")).json() is True
    await screen.events()
    await forward(seconds=60)
    assert (await screen.task(second))["status"] == "SUCCEEDED"
    assert (await screen.events()).count("RESET_MAP_TO_DOCK") == (helped_by == "dock")


@pytest.mark.slow  # a long story
@pytest.mark.world("office", body="hermes")
async def test_order_goes_on_after_a_corrected_pose(
    screen: Screen, robot: Robot, world: World, forward: Forward
) -> None:
    await screen.prepare(R101=(3.0, 0.0, "ROOM"))
    await forward(seconds=3)
    order = await screen.create("R101", "RETURN")
    await forward(seconds=3)
    pose = {"x": 60.0, "y": 60.0, "yaw": 1.0}
    await screen.client.put("/api/core/slam/v1/localization/pose", json=pose)
    await forward(seconds=15)
    assert screen.pose.distance_to(robot[Localization].pose) < 0.1
    await forward(seconds=30)
    assert (await screen.task(order))["status"] == "SUCCEEDED"


@pytest.mark.world("office", body="hermes")
@pytest.mark.parametrize(
    ("language", "word"),
    [
        pytest.param(None, "您的物品到了", marks=pytest.mark.slow),
        ("en-US", "I am here"),
        pytest.param("zh-TW", "到了", marks=pytest.mark.slow),
    ],
)
async def test_the_voice_speaks_the_language_that_was_set(
    screen: Screen, robot: Robot, forward: Forward, language: str | None, word: str
) -> None:
    assert Speaker in robot
    await screen.prepare(R101=(1.0, 0.0, "ROOM"))
    said = robot.events.subscribe(Spoke)
    if language:
        body = {"language": language}
        assert (await screen.client.put(f"{API}/admin/language", json=body)).json()["result"] is True
        assert (await screen.client.get(f"{API}/admin/language")).json() == body
        assert "DELIVERY_SETTINGS_CHANGED" in await screen.events()
    await screen.create("R101", "RETURN")
    await forward(seconds=25)
    assert any(word in event.text for event in said.drain())


@pytest.mark.world("empty", body="hermes")
async def test_a_drop_a_free_brake_and_the_end(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    await new_events(client)
    for fault, event in (("cliff", "CLIFF_DETECTED"), ("brake_released", "BRAKE_RELEASED")):
        world.faults.inject(fault, "a")
        await forward(seconds=0.5)
        assert (await new_events(client)).count(event) == 1
        world.faults.clear()
        await forward(seconds=0.5)
    robot[Power].shut_down(restart_after=1.0)
    await forward(seconds=40)
    assert (await new_events(client)).count("POWER_OFF") == 1


FAILED_RIDES = [
    (RideStage.APPROACHING, Unreachable("no way"), ["SEARCH_ELEVATOR_PATH_FAILED"]),
    (RideStage.CALLING, Expired("late"), ["WAIT_ELEVATOR", "ENTER_ELEVATOR_FAILED"]),
    (
        RideStage.BOARDING,
        Blocked("people"),
        [
            *("ENTER_ELEVATOR_PATH_FOUND", "ENTER_ELEVATOR"),
            *("ENTER_ELEVATOR_OCCUPIED", "TAKE_ELEVATOR_OCCUPIED", "ENTER_ELEVATOR_FAILED"),
        ],
    ),
    (RideStage.RIDING, Expired("stuck"), ["IN_ELEVATOR", "LEAVE_ELEVATOR_FAILED"]),
    (
        RideStage.LEAVING,
        Blocked("a box"),
        ["LEAVE_ELEVATOR", "LEAVE_ELEVATOR_OCCUPIED", "TAKE_ELEVATOR_OCCUPIED", "LEAVE_ELEVATOR_FAILED"],
    ),
]


@pytest.mark.world("empty", body="hermes")
async def test_failed_rides_raise_their_events(robot: Robot, client: httpx.AsyncClient, forward: Forward) -> None:
    """The rides themselves, with what is in their way, are in tests/autonomy/navigation/test_floors.py."""
    for stage, error, events in FAILED_RIDES:

        async def ride(action: Action, stage: RideStage = stage, error: Exception = error) -> None:
            action.report(stage)
            raise error

        robot.actions.start("ride the lift", ride, resources=set())
        await forward(seconds=0.1)
        assert [event for event in await new_events(client) if "ELEVATOR" in event] == events, stage
