"""Tasks of 6004 through the door on a robot with all its skills: relocalisation, navigation, docking."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Awaitable, Callable

import pytest

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.events import LocalizationLost, LocalizationRecovered, LostReason, RecoveryMeans
from roboglot.model.geometry import Pose, Twist
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.mapping import navigation
from roboglot.simulation.world.world import World
from roboglot.testing import Forward
from tests.protocols.cyberdog.phone import App, Client, Stream, localized, state, until

pytestmark = pytest.mark.world("empty")
Passing = Callable[[Callable[[], object]], Awaitable[None]]
LOCALIZED = [3100, 3101, 1000, 1001, 3103, 3104, 3108]


async def test_relocalisation_goes_through_its_feedback(client, robot, forward, passing: Passing) -> None:
    await forward(seconds=1)
    stream = Stream(client, 6004, {"type": 7, "outdoor": False})
    await passing(lambda: stream.ended)
    assert stream.answers[0] == {"accepted": 1}
    assert stream.codes == LOCALIZED
    assert stream.answers[-1] == {"result": 0}
    assert await state(client) == 8
    assert await client.ask(6009, {"type": 7}) == {"result": 0}
    assert await state(client) == 101


async def test_relocalisation_waits_for_the_first_scan(client, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 7})
    await until(lambda: 3100 in stream.codes)  # before the lidar has turned once
    await passing(lambda: stream.ended)
    assert stream.codes == LOCALIZED


async def test_navigation_needs_localization(client, robot, forward, caplog) -> None:
    caplog.set_level("INFO")
    await forward(seconds=1)
    assert await client.ask(6004, {"type": 1, "goalX": 1.0, "goalY": 0.0}) == {"accepted": 2}
    assert "6004 refused: the robot is not localized; 6004 of type 7 localizes it" in caplog.text
    assert await client.ask(6004, {"type": 1, "goalX": 1.0}) == {"error_code": 323}


async def test_navigation_arrives_and_the_app_sees_the_way(
    client: Client, app: App, robot: Robot, world: World, forward: Forward, passing: Passing
) -> None:
    await forward(seconds=1)
    await client.ask(10001)
    await passing(lambda: app.connected)
    await localized(client, passing)
    stream = Stream(client, 6004, {"type": 1, "goalX": 2, "goalY": 1, "theta": 1.5})
    await passing(lambda: stream.ended)
    assert stream.answers[0] == {"accepted": 1}
    assert stream.codes == [309, 310, 1000, 1001, 300, 307, 308]
    assert stream.answers[-1] == {"result": 0}
    pose = robot[Localization].pose
    assert math.hypot(pose.x - 2.0, pose.y - 1.0) < 0.08
    assert abs(pose.yaw - 1.5) < 0.06
    assert await state(client) == 8
    await until(lambda: app.of(6006) and app.of(6006)[-1] == {"path_point": []})
    assert any(len(path["path_point"]) > 1 for path in app.of(6006))
    shown = app.of(6005)[-1]
    assert math.hypot(shown["px"] - 2.0, shown["py"] - 1.0) < 0.2
    assert abs(2.0 * math.atan2(shown["qz"], shown["qw"]) - 1.5) < 0.2
    assert len(app.of(6011)[-1]["laser_point"]) > 100
    assert app.of(6001)[0]["width"] * app.of(6001)[0]["height"] == len(app.of(6001)[0]["data"])
    assert any(ticks.task_status.task_status == 1 for ticks in app.ticks)


async def test_laser_points_lie_on_walls_of_the_map(client, app, robot, forward, passing: Passing) -> None:
    await forward(seconds=1)
    await client.ask(10001)
    await passing(lambda: app.connected)
    await localized(client, passing)
    await passing(lambda: app.of(6011) and app.of(6001))
    grid = app.of(6001)[-1]
    assert set(grid["data"]) <= {-1, 0, 100}

    def cell(x: float, y: float) -> int:
        column = int((x - grid["px"]) / grid["resolution"])
        row = int((y - grid["py"]) / grid["resolution"])
        inside = 0 <= column < grid["width"] and 0 <= row < grid["height"]
        return grid["data"][row * grid["width"] + column] if inside else -1

    points = app.of(6011)[-1]["laser_point"]
    near = [max(cell(p["px"] + dx, p["py"] + dy) for dx in (-0.05, 0, 0.05) for dy in (-0.05, 0, 0.05)) for p in points]
    assert sum(value == 100 for value in near) > 0.8 * len(near)
    pose = robot[Localization].pose
    assert cell(pose.x, pose.y) == 0


async def test_stopping_navigation_brakes_and_stays_localized(client, robot, world, forward, passing: Passing) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    stream = Stream(client, 6004, {"type": 1, "goalX": 4.0, "goalY": 0.0})
    await passing(lambda: 307 in stream.codes)
    stopping = asyncio.ensure_future(client.ask(6009, {"type": 1}))
    await passing(stopping.done)
    assert stopping.result() == {"result": 0}
    assert not robot.actions.running(BASE)
    await until(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 5}
    assert await state(client) == 8
    assert await client.ask(6009, {"type": 0}) == {"result": 0}
    assert await state(client) == 101
    assert await client.ask(6009, {"type": 0}) == {"result": 0}  # no task runs: everything is stopped


async def test_a_goal_that_is_nowhere(client, robot, forward, passing: Passing) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    stream = Stream(client, 6004, {"type": 1, "goalX": 20_000.0, "goalY": 0.0})
    await passing(lambda: stream.ended)
    assert stream.codes[-1] == 306
    assert stream.answers[-1] == {"result": 3}
    assert await state(client) == 8


@pytest.mark.world("tests/autonomy/worlds/closed_room.toml")
@pytest.mark.parametrize(
    "x", [pytest.param(6.0, id="in the wall"), pytest.param(8.0, id="in a closed room", marks=pytest.mark.slow)]
)
async def test_goal_that_no_way_leads_to_is_306(client, clock, world, forward, passing: Passing, x: float) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    goal, begun = Pose(x, 3.0).relative_to(world.truth.pose_of("a")), clock.time()
    stream = Stream(client, 6004, {"type": 1, "goalX": goal.x, "goalY": goal.y})
    await passing(lambda: stream.ended)
    assert stream.codes[-1] == 306
    assert stream.answers[-1] == {"result": 3}
    assert clock.time() - begun < 5.0


async def test_another_door_s_driving_ends_navigation_as_failed(client, robot, forward, passing: Passing) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    stream = Stream(client, 6004, {"type": 1, "goalX": 4.0, "goalY": 0.0})
    await passing(lambda: 307 in stream.codes)
    robot[Driving].drive(Twist(0.1), lifetime=0.5, source="another")
    await passing(lambda: stream.ended)
    assert stream.codes[-1] == 304
    assert stream.answers[-1] == {"result": 3}


async def test_navigation_on_a_replaced_map_leaves_robot_unlocalized(client, robot, forward, passing: Passing) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    stream = Stream(client, 6004, {"type": 1, "goalX": 4.0, "goalY": 0.0})
    await passing(lambda: 307 in stream.codes)
    robot[Mapping].clear()
    stopping = asyncio.ensure_future(client.ask(6009, {"type": 1}))
    await passing(stopping.done)
    assert await state(client) == 101


async def test_task_can_be_rejoined_and_stream_taken_over(client, robot, forward, passing: Passing) -> None:
    assert await client.ask(6010, {"type": 5}) == {"accepted": 3}
    first = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in first.codes)
    assert await client.ask(6010, {"type": 1}) == {"accepted": 3}
    second = Stream(client, 6010, {"type": 5})
    await until(lambda: first.ended and second.codes == [6])
    assert second.answers[0] == {"accepted": 1}
    second.call.cancel()
    await until(lambda: second.ended)
    third = Stream(client, 6010, {"type": 5})
    await until(lambda: third.codes == [6])
    await client.ask(6009, {"type": 5})
    await until(lambda: third.ended)
    assert third.answers[-1] == {"result": 5}


async def test_losing_app_ends_stream_but_not_the_task(client, app, robot, passing: Passing) -> None:
    await client.ask(10001)
    await passing(lambda: app.connected)
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes)
    app.silent = True
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"feedback_code": 6, "feedback_msg": ""}
    assert await state(client) == 5


async def test_docking_goes_home(client, robot, world, forward, passing: Passing) -> None:
    await forward(seconds=1)
    robot[Driving].move_by(Pose(1.0, 0.3, 0.5))
    await forward(seconds=6)
    assert not robot[Battery].state.charging
    stream = Stream(client, 6004, {"type": 9})
    await passing(lambda: stream.ended)
    assert stream.codes == [1000, 500]
    assert stream.answers[-1] == {"result": 0}
    await forward(seconds=3)
    assert (await client.ask(10001))["charging_status"]["wireless_charging"]


async def test_tasks_that_no_one_can_do(client, robot) -> None:
    assert await client.ask(6004, {"type": 99}) == {"accepted": 2}
    mapping = Stream(client, 6004, {"type": 5, "relative_pos": 0, "keep_distance": -1})  # fields of another task
    await until(lambda: mapping.answers)
    assert mapping.answers[0] == {"accepted": 1}
    assert await client.ask(6004, {}) == {"error_code": 323}


async def test_an_empty_battery_stops_the_task(client, robot, passing: Passing) -> None:
    stream = Stream(client, 6004, {"type": 5})
    await passing(lambda: 6 in stream.codes)
    robot[Battery].set_charge(0.03)
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 5}
    assert await client.ask(6004, {"type": 5}) == {"accepted": 2}


async def test_relocalisation_that_does_not_fit_gives_up(client, robot, forward, passing: Passing, monkeypatch) -> None:
    await forward(seconds=1)
    monkeypatch.setattr(type(robot[Localization]), "quality", property(lambda _: 0.1))
    monkeypatch.setattr(robot[Localization].estimator, "placing", lambda _: None)  # nothing fits anywhere
    monkeypatch.setattr(navigation, "GIVE_UP_AFTER", 10.0)
    stream = Stream(client, 6004, {"type": 7})
    await until(lambda: 3104 in stream.codes)
    await forward(seconds=12)
    await until(lambda: stream.ended)
    assert 3107 in stream.codes
    assert stream.codes[-1] == 3106
    assert stream.answers[-1] == {"result": 3}
    assert await state(client) == 6


async def test_lost_robot_reports_it_until_localized_again(
    client: Client, robot: Robot, forward: Forward, passing: Passing
) -> None:
    await forward(seconds=1)
    await localized(client, passing)
    lost = LocalizationLost(stamp=1.0, reason=LostReason.NO_FIT, quality=0.1)
    found = LocalizationRecovered(stamp=2.0, means=RecoveryMeans.WHOLE_MAP, pose=Pose(), seconds=1.0)
    robot.events.publish(lost)
    assert await state(client) == 6
    assert await client.ask(6004, {"type": 1, "goalX": 1.0, "goalY": 0.0}) == {"accepted": 2}
    robot.events.publish(found)
    assert await state(client) == 8
    stream = Stream(client, 6004, {"type": 1, "goalX": 2, "goalY": 1, "theta": 1.5})
    await passing(lambda: 307 in stream.codes)
    robot.events.publish(lost)
    await passing(lambda: 3107 in stream.codes)
    robot.events.publish(found)
    await passing(lambda: 3108 in stream.codes)
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}
    assert await state(client) == 8
