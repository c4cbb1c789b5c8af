"""Wheel slip where the map cannot show it, judged by the world."""

from __future__ import annotations

from pathlib import Path

import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Pose, Twist
from roboglot.storage.database import Database
from tests.autonomy.slam.test_loops import RING, short_sighted
from tests.masking import mask_bumper


@pytest.mark.slow
@pytest.mark.parametrize("held", [True, False])
async def test_pressing_against_hidden_obstacle_counts_as_no_motion(tmp_path: Path, held: bool) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig(body=short_sighted(tmp_path))]
    fleet = build_fleet(RING, robots, clock=clock, seed=2, database=database)
    fleet.world.stage.place("a", Pose(14.0, 1.3, 0.0))
    await fleet.start(wait=True)
    robot, start = fleet.robots["a"], fleet.world.truth.pose_of("a")
    await clock.advance(1.0)
    mask_bumper(robot)
    if held:
        fleet.world.stage.add_obstacle(Pose(15.0, 1.3, 0.0), (0.4, 1.2, 1.0))
    robot[Driving].drive(Twist(x=0.4), lifetime=20.0)
    await clock.advance(20.0)
    truth = fleet.world.truth.pose_of("a")
    error = start.compose(robot[Localization].pose).distance_to(truth)
    odometry = start.compose(robot[Odometry].reading.pose).distance_to(truth)
    await fleet.close()
    database.close()
    if held:
        assert truth.x < 14.8
        assert odometry > 4.0  # the wheels turned
        assert error < 0.15
    else:
        assert truth.x > 20.0  # driving along a bare corridor is no slipping
        assert error < 1.0
