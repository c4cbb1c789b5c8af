"""Robots among robots: what stands is not shoved, and no robot lies. 200 crowds are in benchmarks/robots/crowd.py."""

from __future__ import annotations

import math

import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.events import BumperPressed
from roboglot.model.geometry import Pose, Twist
from roboglot.storage.database import Database
from tests.crowd import CORRIDOR, SHOVED, SURE, crowd, leave


@pytest.mark.slow  # in short: test_a_robot_in_the_way_is_driven_around
async def test_nothing_that_stands_is_shoved() -> None:
    outcome = await crowd(6, seconds=18.0)
    assert outcome.shoved <= SHOVED, outcome.worst
    assert not outcome.false_successes
    assert not outcome.sure_but_astray


@pytest.mark.slow  # six robots in short: test_nothing_that_stands_is_shoved
async def test_ten_robots_leave_one_corridor() -> None:
    outcome = await leave(1, seconds=30.0)
    assert outcome.shoved <= SHOVED, outcome.worst
    assert not outcome.silent
    assert not outcome.false_successes
    assert not outcome.sure_but_astray
    assert outcome.arrived >= 4


@pytest.mark.slow  # ten robots, 40 s each; the tests below have the rule in short
@pytest.mark.parametrize("seed", [2, 3, 4, 5, 6, 7, 8, 20, 21])
async def test_no_robot_of_a_convoy_believes_to_stand(seed: int) -> None:
    outcome = await leave(seed, seconds=40.0)
    assert not outcome.sure_but_astray
    assert not outcome.silent
    assert not outcome.false_successes


@pytest.mark.slow  # with fewer: test_nothing_that_stands_is_shoved
async def test_robot_whose_neighbours_move_along_believes_its_wheels() -> None:
    """Between two bare walls most echoes come from robots that drive as fast, and suggest that it stands."""
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig(f"r{n}", body="hermes") for n in range(5)]
    fleet = build_fleet(CORRIDOR, robots, clock=clock, seed=1, database=database)
    starts = [Pose(2.4 + 0.9 * n, 2.6 if n % 2 else 3.4) for n in range(5)]
    for config, start in zip(robots, starts, strict=True):
        fleet.world.stage.place(config.name, start)
    await fleet.start(wait=True)
    await clock.advance(1.0)
    for robot in fleet.robots.values():
        robot[Driving].drive(Twist(x=0.5), lifetime=5.0)
    worst = 0.0
    for _ in range(60):
        await clock.advance(0.1)
        for (name, robot), start in zip(fleet.robots.items(), starts, strict=True):
            believed = start.compose(robot[Localization].pose)
            if robot[Localization].quality > SURE:
                worst = max(worst, believed.distance_to(fleet.world.truth.pose_of(name)))
    await fleet.close()
    database.close()
    assert worst < 0.15


@pytest.mark.parametrize(
    ("body", "other"),
    [
        ("hermes", "hermes"),
        pytest.param("cyberdog2", "robomaster_ep", marks=pytest.mark.slow),
        pytest.param("hermes", "cyberdog2", marks=pytest.mark.slow),
        pytest.param("hermes", "robomaster_ep", marks=pytest.mark.slow),
    ],
)
async def test_a_robot_in_the_way_is_driven_around(body: str, other: str) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig("a", body=body), RobotConfig("b", body=other)]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    start, stands = Pose(1.5, 5.0), Pose(4.5, 5.0)
    fleet.world.stage.place("a", start)
    fleet.world.stage.place("b", stands)
    await fleet.start(wait=True)
    await clock.advance(1.0)
    action = fleet.robots["a"][Navigation].navigate_to([Pose(6.0, 0.0).point], NavigationOptions())
    for _ in range(300):
        if action.status.ended:
            break
        await clock.advance(0.1)
    arrived, shoved = fleet.world.truth.pose_of("a"), fleet.world.truth.pose_of("b").distance_to(stands)
    await fleet.close()
    database.close()
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert arrived.distance_to(Pose(7.5, 5.0)) < 0.1
    assert shoved < 0.005


@pytest.mark.parametrize("looking", ["universal", "hermes", "cyberdog2"])
async def test_a_lidar_sees_no_gap_in_a_robot(looking: str) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig("a", body=looking), *(RobotConfig(b, body=b) for b in ("universal", "hermes", "cyberdog2"))]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    fleet.world.stage.place("a", Pose(5.0, 5.0))
    for number, name in enumerate(("universal", "hermes", "cyberdog2")):
        way = math.radians(120.0 * number)
        fleet.world.stage.place(name, Pose(5.0 + 2.0 * math.cos(way), 5.0 + 2.0 * math.sin(way)))
    await fleet.start(wait=True)
    await clock.advance(0.5)
    scan = fleet.robots["a"][Lidar].scan
    assert scan is not None
    for number, name in enumerate(("universal", "hermes", "cyberdog2")):
        ray = round((math.radians(120.0 * number) - scan.angle_min) / scan.angle_increment) % len(scan.ranges)
        gap = 2.0 - fleet.robots[name].description.radius
        assert scan.ranges[ray] == pytest.approx(gap, abs=0.06), name
    await fleet.close()
    database.close()


@pytest.mark.slow  # in short: test_a_robot_in_the_way_is_driven_around
async def test_robots_below_the_lidar_are_not_touched() -> None:
    """Two low robots leave no gap; the dog, which sees them from in front only, looks for one."""
    clock, database, bodies = LockstepClock(), Database(":memory:"), ("cyberdog2", "robomaster_ep", "robomaster_ep")
    robots = [RobotConfig(name, body=body) for name, body in zip("abc", bodies, strict=True)]
    fleet = build_fleet(CORRIDOR, robots, clock=clock, seed=1, database=database)
    for name, place in zip("abc", (Pose(2.0, 3.0), Pose(4.0, 2.75), Pose(4.0, 3.25)), strict=True):
        fleet.world.stage.place(name, place)
    await fleet.start(wait=True)
    await clock.advance(1.0)
    robot = fleet.robots["a"]
    presses: list[BumperPressed] = []
    robot.events.listen(BumperPressed, presses.append)
    robot[Navigation].navigate_to([Pose(4.0).point], NavigationOptions())
    await clock.advance(8.0)
    await fleet.close()
    database.close()
    assert not presses


async def test_a_fast_robot_touches_softly() -> None:
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig("a", body="cyberdog2"), RobotConfig("b", body="robomaster_ep")]
    fleet = build_fleet("empty", robots, clock=clock, seed=1, database=database)
    fleet.world.stage.place("a", Pose(2.0, 5.0))
    fleet.world.stage.place("b", Pose(6.0, 5.0))
    await fleet.start(wait=True)
    await clock.advance(0.5)
    robot = fleet.robots["a"]
    action = robot[Driving].move_by(Pose(6.0), speed=1.6)
    await clock.advance(10.0)
    assert action.status is ActionStatus.ABORTED
    assert "bumper" in action.reason
    assert fleet.world.truth.pose_of("b").distance_to(Pose(6.0, 5.0)) < SHOVED
    believed = Pose(2.0, 5.0).compose(robot[Localization].pose)
    assert believed.distance_to(fleet.world.truth.pose_of("a")) < 0.05
    await fleet.close()
    database.close()
