"""Bare corridors, where nothing shows the way along them: the robot says so. Judged by the world."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import cast

import numpy as np
import pytest

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Pose, Vector3
from roboglot.simulation.bodies.files import BODIES
from roboglot.storage.database import Database
from tests.autonomy.slam.test_loops import RING

BACK = Vector3(-12.0, 0.0, 0.0)  # N s: some 3 cm


@pytest.mark.slow  # the matching alone: tests/kernels/test_doubt.py
@pytest.mark.parametrize("seed", [1, 3])
async def test_a_robot_pushed_back_knows_its_error(tmp_path: Path, seed: int) -> None:
    """It was sure to 4 cm at a place 20 cm off."""
    body = tmp_path / "near.toml"
    text = (BODIES / "universal.toml").read_text()
    body.write_text(re.sub(r"(?m)^range_max = 12.0", "range_max = 4.0", text, count=1))
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet(RING, [RobotConfig(body=str(body))], clock=clock, seed=seed, database=database)
    fleet.world.stage.place("a", Pose(12.0, 1.3, 0.0))
    await fleet.start(wait=True)
    robot, start = fleet.robots["a"], fleet.world.truth.pose_of("a")
    await clock.advance(1.0)
    localization = robot[Localization]
    assert isinstance(localization, LidarLocalization)
    assert localization.estimator is not None
    action = robot[Navigation].navigate_to([Pose(13.0, 0.0).point], NavigationOptions(tolerance=0.3))
    errors, sigmas, pushed = [], [], 13.0
    while not action.status.ended:
        await clock.advance(0.3)
        truth = fleet.world.truth.pose_of("a")
        if truth.x > pushed:
            pushed += 2.0
            fleet.world.stage.push("a", BACK)
        errors.append(abs(localization.pose.x - truth.relative_to(start).x))
        sigmas.append(math.sqrt(localization.estimator.trajectory()[-1].covariance[0, 0]))
    quality = localization.quality
    await fleet.close()
    database.close()
    assert action.error is None
    assert max(errors) > 0.08  # otherwise the test proves nothing
    assert all(error < 4.0 * sigma for error, sigma in zip(errors, sigmas, strict=True))
    assert sigmas[-1] > 0.05
    assert quality < 0.99


@pytest.mark.parametrize(("sigma", "share"), [(0.003, 1.0), (0.25, 0.8), (0.5, 0.5), (1.0, 0.2)])
def test_an_open_place_lowers_the_quality(sigma: float, share: float) -> None:
    belief = Belief(odometry=cast(Odometry, None), quality=0.9, doubt=np.diag([0.003**2, sigma**2, 0.002**2]))
    assert belief.score == pytest.approx(0.9 * share, rel=1e-3)
    belief.localizing = False  # odometry alone is what was asked for
    assert belief.score == 0.9
