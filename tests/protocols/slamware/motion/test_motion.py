"""Actions through a real socket: the simulated robot goes where the client says."""

import math
from typing import Any

import httpx
import pytest

from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.geometry import Pose, Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world import World
from roboglot.testing import Forward, assert_pose

pytestmark = pytest.mark.world("empty")
MOTION = "/api/core/motion/v1"
ACTIONS = f"{MOTION}/actions"
FIRMWARE_4, FIRMWARE_6 = "slamtec.agent.actions.", "agent.actions."


async def start(client: httpx.AsyncClient, name: str, prefix: str = FIRMWARE_4, /, **options: object) -> Any:
    """POST the action and check the answer's form."""
    reply = await client.post(ACTIONS, json={"action_name": prefix + name, "options": options})
    assert reply.status_code == 200, reply.text
    info = reply.json()
    assert set(info) == {"action_id", "action_name", "stage", "state"}
    assert info["action_name"] == prefix + name
    assert info["action_id"] > 0
    return info


async def finish(client: httpx.AsyncClient, forward: Forward, id: int, *, within: float = 60.0) -> Any:
    """Poll as clients do, four times a second, until the status is 4; the gravestone's state."""
    for _ in range(int(within * 4)):
        info = (await client.get(f"{ACTIONS}/{id}")).json()
        if info["state"]["status"] == 4:
            assert set(info) == {"action_id", "state"}
            return info["state"]
        assert info["state"]["status"] in (0, 1)
        assert info["stage"] not in ("FINISHED", "SUCCEEDED", "COMPLETED", "STOPPED")
        await forward(seconds=0.25)
    raise AssertionError(f"action {id} has not ended within {within} s: {info}")


def map_pose(world: World, start_pose: Pose) -> Pose:
    """Return the robot's true pose in the map, whose origin is where it woke up."""
    return world.truth.pose_of("a").relative_to(start_pose)


SUCCESS = {"status": 4, "result": 0, "reason": ""}


async def test_the_kinds_of_action(client: httpx.AsyncClient) -> None:
    names = {factory["action_name"] for factory in (await client.get(f"{MOTION}/action-factories")).json()}
    assert names == {
        FIRMWARE_4 + name
        for name in (
            "MoveToAction",
            "SeriesMoveToAction",
            "MoveByAction",
            "RotateAction",
            "RotateToAction",
            "GoHomeAction",
            "FollowPathPointsAction",
            "SweepAction",
            "RecoverLocalizationAction",
            "ManualRelocalizationAction",
            "ReturnToParkingAction",
            "JackMoveAction",
            "JackTopMoveToAction",
            "MultiFloorMoveAction",
            "MultiFloorBackHomeAction",
            "EnterElevatorAction",
            "LeaveElevatorAction",
            "MoveToTagAction",
            "SchedulableMoveToTagAction",
            "BackOffFromTagAction",
        )
    }


@pytest.mark.parametrize("prefix", [FIRMWARE_4, FIRMWARE_6])
async def test_go_there_poll_and_find_the_gravestone(
    client: httpx.AsyncClient, world: World, forward: Forward, prefix: str
) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    info = await start(
        client,
        "MoveToAction",
        prefix,
        target={"x": 2.0, "y": 1.0, "z": 0},
        move_options={"mode": 0, "flags": ["with_yaw"], "yaw": 1.57, "acceptable_precision": 0, "speed_ratio": 0},
    )
    assert info["state"] == {"status": 0, "result": 0, "reason": ""}
    await forward(seconds=2)
    current = (await client.get(f"{ACTIONS}/:current")).json()
    assert (current["action_id"], current["action_name"]) == (info["action_id"], prefix + "MoveToAction")
    assert current["state"]["status"] == 1
    assert current["stage"] in ("", "GOING_TO_TARGET")
    path = (await client.get(f"{MOTION}/path")).json()["path_points"]
    assert path[-1] == pytest.approx([2.0, 1.0], abs=0.1)
    assert (await client.get(f"{MOTION}/milestones")).json()["path_points"] == [[2.0, 1.0]]
    assert (await client.get(f"{MOTION}/time")).json() > 0
    speed = (await client.get(f"{MOTION}/speed")).json()
    assert math.hypot(speed["vx"], speed["vy"]) > 0.05
    assert await finish(client, forward, info["action_id"]) == SUCCESS
    assert_pose(map_pose(world, origin), x=2.0, y=1.0, deg=90, within=0.08, within_deg=3)
    assert (await client.get(f"{ACTIONS}/:current")).status_code == 404
    assert (await client.get(f"{MOTION}/path")).json() == {"path_points": []}
    assert (await client.get(f"{MOTION}/time")).json() == 0


@pytest.mark.parametrize(("precision", "status"), [(0.8, (4, 0)), (0, (4, -1))])
async def test_occupied_target_may_be_reached_nearly(
    client: httpx.AsyncClient, world: World, forward: Forward, precision: float, status: tuple[int, int]
) -> None:
    """With ``precise``, which is for free targets, what a client accepts at an occupied one had no effect."""
    origin = world.truth.pose_of("a")
    world.stage.add_obstacle(origin.compose(Pose(2.0, 0.0)), (0.3, 0.3, 1.0))
    await forward(seconds=1)
    how = {"mode": 0, "flags": ["precise"], "acceptable_precision": precision}
    info = await start(client, "MoveToAction", target={"x": 2.0, "y": 0.0}, move_options=how)
    state = await finish(client, forward, info["action_id"], within=120.0)
    assert (state["status"], state["result"]) == status
    pose = map_pose(world, origin)
    assert (math.hypot(pose.x - 2.0, pose.y) < 0.8) is (state["result"] == 0)


async def test_through_several_points(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    origin = world.truth.pose_of("a")
    await forward(seconds=1)
    targets = [{"x": 2.0, "y": 1.0}, {"x": 3.0, "y": -1.0}]
    info = await start(client, "SeriesMoveToAction", targets=targets, move_options={"mode": 0, "flags": [None]})
    await forward(seconds=1)
    assert (await client.get(f"{MOTION}/milestones")).json()["path_points"] == [[2.0, 1.0], [3.0, -1.0]]
    left = math.inf
    while True:
        left = min(left, map_pose(world, origin).distance_to(Pose(2.0, 1.0)))
        if (await client.get(f"{ACTIONS}/{info['action_id']}")).json()["state"]["status"] == 4:
            break
        await forward(seconds=0.25)
    assert left < 0.3
    assert_pose(map_pose(world, origin), x=3.0, y=-1.0, within=0.08)


async def test_goal_off_the_map_cannot_be_reached(client: httpx.AsyncClient, forward: Forward) -> None:
    await forward(seconds=1)
    info = await start(client, "MoveToAction", target={"x": 500.0, "y": 0.0})
    state = await finish(client, forward, info["action_id"], within=120)
    assert (state["result"], state["reason"]) == (-1, "CANNOT_REACH_TARGET")


@pytest.mark.world("tests/autonomy/worlds/closed_room.toml", body="hermes")
@pytest.mark.parametrize("x", [6.0, 8.0], ids=["in the wall", "in a closed room"])
async def test_enclosed_goal_cannot_be_reached(client, world, forward: Forward, x: float) -> None:
    await forward(seconds=1)
    goal = Pose(x, 3.0).relative_to(world.truth.pose_of("a"))
    info = await start(client, "MoveToAction", target={"x": goal.x, "y": goal.y})
    state = await finish(client, forward, info["action_id"], within=5)
    assert (state["result"], state["reason"]) == (-1, "CANNOT_REACH_TARGET")


async def test_a_path_is_found_without_going(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    await forward(seconds=1)
    before = world.truth.pose_of("a")
    url = f"{MOTION}/:search_path"
    points = (await client.post(url, json={"target": {"x": 2, "y": 1}, "timeout": 5000})).json()["path_points"]
    here = robot[Localization].pose
    assert points[0] == pytest.approx([here.x, here.y], abs=0.1)
    assert points[-1] == pytest.approx([2, 1], abs=0.1)
    assert (await client.post(url, json={"target": {"x": 99, "y": 0}})).json() == {"path_points": []}
    assert (await client.post(url, json={"target": 5})).status_code == 400
    assert world.truth.pose_of("a").distance_to(before) < 0.01


@pytest.mark.parametrize(
    ("options", "twist"),
    [
        ({"direction": 0}, Twist(x=1)),
        ({"direction": 1}, Twist(x=-1)),
        ({"direction": 2}, Twist(yaw=-1)),
        ({"direction": 3, "speed_ratio": 1, "linear_velocity": 5}, Twist(yaw=1)),
        ({"theta": 0.5}, Twist(yaw=1)),
        ({"theta": -0.5, "duration": 300}, Twist(yaw=-1)),
    ],
)
async def test_remote_control_stops_by_itself(
    client: httpx.AsyncClient, world: World, forward: Forward, options: dict[str, object], twist: Twist
) -> None:
    world.stage.place("a", Pose(5.0, 5.0))
    await forward(seconds=1)
    before = world.truth.pose_of("a")
    info = await start(client, "MoveByAction", **options)  # type: ignore[arg-type]
    await forward(seconds=2)
    moved = world.truth.pose_of("a").relative_to(before)
    assert (moved.x > 0.05, moved.x < -0.05) == (twist.x > 0, twist.x < 0)
    assert (moved.yaw > 0.05, moved.yaw < -0.05) == (twist.yaw > 0, twist.yaw < 0)
    assert await finish(client, forward, info["action_id"], within=0.5) == SUCCESS
    after = world.truth.pose_of("a")
    await forward(seconds=1)
    assert world.truth.pose_of("a").distance_to(after) < 0.005


async def test_remote_control_goes_on_while_repeated(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    world.stage.place("a", Pose(3.0, 5.0))
    await forward(seconds=1)
    ids = set()
    for _ in range(20):
        ids.add((await start(client, "MoveByAction", direction=0))["action_id"])
        await forward(seconds=0.2)
    assert len(ids) == 1
    assert world.truth.pose_of("a").x - 3.0 == pytest.approx(4 * 0.4, abs=0.15)
    await client.delete(f"{ACTIONS}/:current")
    await forward(seconds=1)
    assert (await client.get(f"{ACTIONS}/{ids.pop()}")).json()["state"]["result"] == -2


@pytest.mark.parametrize("angle", [math.pi / 2, -2.5, 7.0])
async def test_turn_by_an_angle(client: httpx.AsyncClient, world: World, forward: Forward, angle: float) -> None:
    world.stage.place("a", Pose(5.0, 5.0, 0.3))
    await forward(seconds=1)
    info = await start(client, "RotateAction", angle=angle)
    assert await finish(client, forward, info["action_id"]) == SUCCESS
    assert_pose(world.truth.pose_of("a"), x=5.0, y=5.0, deg=math.degrees(wrap_angle(0.3 + angle)), within_deg=3)


async def test_turn_to_a_heading(robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    await forward(seconds=1)
    robot[Driving].move_by(Pose(x=1.0))
    await forward(seconds=8)
    origin_yaw = world.truth.pose_of("a").yaw - robot[Localization].pose.yaw
    for angle in (2.0, -2.0):
        info = await start(client, "RotateToAction", angle=angle)
        assert await finish(client, forward, info["action_id"]) == SUCCESS
        assert robot[Localization].pose.yaw == pytest.approx(angle, abs=0.05)
        assert wrap_angle(world.truth.pose_of("a").yaw - origin_yaw - angle) == pytest.approx(0, abs=0.06)


async def test_go_home(robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    await forward(seconds=1)
    home = (await client.get("/api/core/slam/v1/homepose")).json()
    assert (home["x"], home["y"]) == pytest.approx((0, 0), abs=0.05)
    info = await start(client, "MoveToAction", target={"x": 2.0, "y": 1.0})
    assert await finish(client, forward, info["action_id"]) == SUCCESS
    assert not robot[DockContact].docked
    info = await start(client, "GoHomeAction", gohome_options={"flags": "dock", "charging_retry_count": 3})
    stages = set()
    for _ in range(480):
        reply = (await client.get(f"{ACTIONS}/{info['action_id']}")).json()
        stages.add(reply.get("stage"))
        if reply["state"]["status"] == 4:
            break
        await forward(seconds=0.25)
    assert reply["state"] == SUCCESS
    assert "GOING_TO_LANDING_POINT" in stages
    assert robot[DockContact].docked
    await forward(seconds=3)
    assert (await client.get("/api/core/system/v1/power/status")).json()["dockingStatus"] == "on_dock"
    events = [event["type"] for event in (await client.get("/api/platform/v1/events")).json()]
    assert [event for event in events if event.endswith("DOCK")] == ["OFF_DOCK", "ON_DOCK"]
    assert [event for event in events if event.endswith("CHARGING")] == [
        "START_CHARGING",
        "STOP_CHARGING",
        "START_CHARGING",
    ]


async def test_the_dock_can_take_pose(robot: Robot, client: httpx.AsyncClient) -> None:
    reply = await client.put("/api/core/slam/v1/homepose", json={"x": 1.0, "y": 2.0, "yaw": 3.0})
    assert reply.json() is True
    assert robot[Docking].home == Pose(1.0, 2.0, 3.0)
    (dock,) = (await client.get("/api/core/slam/v1/homedocks")).json()
    assert dock["pose"] == {"x": 1.0, "y": 2.0, "yaw": 3.0}
    assert dock["metadata"]["display_name"]


async def test_a_new_action_takes_over(client: httpx.AsyncClient, world: World, forward: Forward) -> None:
    world.stage.place("a", Pose(5.0, 5.0))
    await forward(seconds=1)
    turning = await start(client, "RotateAction", angle=20.0)
    await forward(seconds=1)
    driving = await start(client, "MoveByAction", direction=0, duration=3000)
    assert driving["action_id"] > turning["action_id"]
    await forward(seconds=1)
    assert (await client.get(f"{ACTIONS}/:current")).json()["action_id"] == driving["action_id"]
    state = (await client.get(f"{ACTIONS}/{turning['action_id']}")).json()["state"]
    assert (state["status"], state["result"]) == (4, -2)


async def test_the_stop_button_stops_what_anybody_began(
    robot: Robot, client: httpx.AsyncClient, world: World, forward: Forward
) -> None:
    world.stage.place("a", Pose(3.0, 5.0))
    await forward(seconds=1)
    action = robot[Driving].drive(Twist(x=0.5), source="someone else")
    await forward(seconds=1)
    current = (await client.get(f"{ACTIONS}/:current")).json()
    assert (current["action_id"], current["action_name"]) == (action.id, FIRMWARE_4 + "MoveByAction")
    assert (await client.delete(f"{ACTIONS}/:current")).status_code == 200
    await forward(seconds=2)
    assert (await client.get(f"{ACTIONS}/:current")).status_code == 404
    assert (await client.get(f"{MOTION}/speed")).json()["vx"] == pytest.approx(0, abs=0.01)


INVALID = [
    ("DanceAction", {}),
    ("MoveToAction", {}),
    ("MoveToAction", {"target": {"x": "nan", "y": 0}}),
    ("MoveToAction", {"target": {"x": 1, "y": 0}, "move_options": {"mode": 1}}),
    ("MoveToAction", {"target": {"x": 1, "y": 0}, "move_options": {"mode": 7}}),
    ("SeriesMoveToAction", {"targets": []}),
    ("MoveByAction", {}),
    ("MoveByAction", {"direction": 4}),
    ("MoveByAction", {"direction": 0, "duration": 10**9}),
    ("MoveByAction", {"theta": "nan"}),
    ("MoveByAction", {"direction": 0, "theta": 0.5}),
    ("RotateToAction", {"orientation": {"yaw": 1}}),
    ("RotateAction", {"angle": 1e9}),
    ("GoHomeAction", {"gohome_options": {"flags": "dock", "move_options": {"mode": 1}}}),
    ("FollowPathPointsAction", {"path_points": []}),
    ("SweepAction", {}),
    ("MoveToTagAction", {"target": {"x": 1, "y": 0}, "target_relative_pose": {"x": 0.1, "y": 0}}),
    ("MoveToTagAction", {"target": {"x": 1, "y": 0}, "tag_type": 9}),
    ("BackOffFromTagAction", {"backup_mode": 2, "tag_type": 1}),
    ("SweepAction", {"sweep_options": {"region_ids": [77]}}),
    ("RecoverLocalizationAction", {"relocalization_options": {"recover_movement_type": "Dance"}}),
    ("JackMoveAction", {"move_direction": "Sideways"}),
    ("GoHomeAction", {"gohome_options": {"flags": "zzz"}}),
    ("GoHomeAction", {"gohome_options": {"flags": ""}}),
]


async def test_invalid_actions_are_not_created(client: httpx.AsyncClient, forward: Forward) -> None:
    for name, options in INVALID:
        reply = await client.post(ACTIONS, json={"action_name": FIRMWARE_4 + name, "options": options})
        assert (reply.status_code, reply.reason_phrase) == (400, "Can not create action"), (name, options)
        await forward(seconds=0.1)
        assert (await client.get(f"{ACTIONS}/:current")).status_code == 404, (name, options)


async def test_closing_the_door_stops_what_its_clients_began(
    robot: Robot, door: SlamwareDoor, client: httpx.AsyncClient, forward: Forward
) -> None:
    info = await start(client, "RotateAction", angle=20.0)
    await forward(seconds=1)
    await door.close()
    await forward(seconds=1)
    assert robot.actions.get(info["action_id"]).status.name == "CANCELED"
