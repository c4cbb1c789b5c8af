"""Presets of how good sensors are: clean, usual, hard; judged by what the robot reports against the truth."""

from __future__ import annotations

from contextlib import closing

import numpy as np
import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.actions import ActionStatus
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Pose, Twist
from roboglot.simulation.world.declarations import BadFile
from roboglot.storage.database import Database


async def circled(body: str) -> tuple[float, float, list[tuple[float, float]]]:
    """Return odometry's error after a bent drive (m), the share of silent rays, and where scans were taken."""
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("empty", [RobotConfig(body=body)], clock=clock, seed=4, database=database)
    fleet.world.stage.place("a", Pose(5.0, 3.0))
    await fleet.start(wait=True)
    robot, start, unknown, trace = fleet.robots["a"], fleet.world.truth.pose_of("a"), [], []

    def look(event: ScanTaken) -> None:
        unknown.append(float(np.isnan(event.scan.ranges).mean()))
        trace.append((event.stamp, event.odometry.x))

    robot.events.listen(ScanTaken, look)
    robot[Driving].drive(Twist(0.4, 0.0, 0.3), lifetime=12.0)
    await clock.advance(14.0)
    assert robot[Lidar].scan is not None
    off = start.compose(robot[Odometry].reading.pose).distance_to(fleet.world.truth.pose_of("a"))
    await fleet.close()
    database.close()
    return off, float(np.mean(unknown)), trace


@pytest.mark.slow  # the hard one: test_black_furniture_answers_from_near_touching_lidar_unknown
async def test_the_presets_differ_as_they_should() -> None:
    clean, usual, hard = [await circled(f"hermes{preset}") for preset in ("+clean", "+usual", "+hard")]
    assert clean[0] < 0.03
    assert usual[0] < 0.15
    assert hard[0] > 2.0 * usual[0]
    assert clean[1] == usual[1] == 0.0
    assert 0.02 < hard[1] < 0.15


@pytest.mark.slow  # long; test_world_trace.py has the same seed's trace
async def test_usual_realism_is_default_and_seeds_are_repeatable() -> None:
    assert (await circled("hermes"))[2] == (await circled("hermes+usual"))[2]
    assert (await circled("hermes+hard"))[2] == (await circled("hermes+hard"))[2]


def test_an_unknown_preset_is_refused_in_words() -> None:
    robots = [RobotConfig(body="hermes+worse")]
    with closing(Database(":memory:")) as database, pytest.raises(BadFile, match="clean, usual, hard"):
        build_fleet("empty", robots, clock=LockstepClock(), seed=1, database=database)


@pytest.mark.slow  # with usual sensors: tests/autonomy/navigation/test_navigation.py
@pytest.mark.parametrize("body", ["hermes+hard", "universal+hard"])
async def test_goals_on_hard_days_are_reached_doubling_tolerance(body: str) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig(body=body)], clock=clock, seed=2, database=database)
    await fleet.start(wait=True)
    robot, start = fleet.robots["a"], fleet.world.truth.pose_of("a")
    await clock.advance(1.0)
    for spot in ((25.5, 10.0), (26.0, 7.0), (19.0, 9.8)):
        goal = Pose(*spot).relative_to(start).point
        action = robot[Navigation].navigate_to([goal], NavigationOptions(retries=2))
        while not action.status.ended:
            await clock.advance(0.5)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        truth = fleet.world.truth.pose_of("a")
        assert truth.distance_to(Pose(*spot)) < 0.2
        assert start.compose(robot[Localization].pose).distance_to(truth) < 0.2
    await fleet.close()
    database.close()


async def test_black_furniture_answers_from_near_touching_lidar_unknown() -> None:
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig(body="hermes+hard")], clock=clock, seed=2, database=database)
    await fleet.start(wait=True)
    sight, hull = fleet.world._environment.sight, fleet.world._population.hulls["a"]
    black = sight.dark(hull, 0.3, 360, 30.0, 1.0)
    assert np.isfinite(black).any()
    assert (black >= sight.turn(hull, 0.3, 360, 30.0) - 1e-6).all()
    assert np.isfinite(sight.dark(hull, 0.3, 360, 30.0, 0.2)).sum() < np.isfinite(black).sum()
    near = sight.blur(np.array([0.01, 1.0, np.inf]), np.zeros(3, np.float32), 0.0, 0.1, 20.0)
    assert np.isnan(near[0])
    assert near[1:].tolist() == [1.0, np.inf]
    await fleet.close()
    database.close()
