"""Memory of odometry: what was learnt of wheels outlives a restart, and the body's description is believed."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.autonomy.slam.odometry.memory import KEY
from roboglot.autonomy.slam.odometry.noise import (
    FACTOR_MAX,
    SCALE_BIAS_MAX,
    SCALE_KEPT,
    SCALE_UNKNOWN,
    TURN_UNKNOWN,
    Doubt,
    LearntBias,
    LearntNoise,
)
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry, OdometryNoise
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Pose
from roboglot.simulation.bodies.files import BODIES
from roboglot.storage.database import Database
from tests.narrowing import known, of_kind


def misjudged(folder: Path) -> str:
    """Return a body whose wheels are less exact than most, as its file says."""
    text = (BODIES / "universal.toml").read_text()
    text = re.sub(r"(?m)^scale_error = .*$", "scale_error = 0.1\ndescribed = { along = 0.02 }", text)
    (folder / "misjudged.toml").write_text(text)
    return str(folder / "misjudged.toml")


async def test_learnt_odometry_survives_a_restart(tmp_path: Path) -> None:
    database, learnt = Database(tmp_path / "data.db", in_place=True), []
    for _ in range(2):
        clock = LockstepClock()
        fleet = build_fleet("office", [RobotConfig(body=misjudged(tmp_path))], clock=clock, seed=3, database=database)
        await fleet.start(wait=True)
        robot = fleet.robots["a"]
        assert robot[Odometry].noise.along == 0.02
        learnt.append(known(of_kind(robot[Localization], LidarLocalization).estimator).odometry.kept)
        await clock.advance(1.0)
        robot[Driving].move_by(Pose(3.0), speed=0.6)
        await clock.advance(8.0)
        learnt.append(known(of_kind(robot[Localization], LidarLocalization).estimator).odometry.kept)
        await fleet.close()
        assert robot[Settings].get(KEY) == learnt[-1]
    database.close()
    new, driven, restarted, _ = learnt
    assert new["scale_x"] == 0.0
    assert driven != new
    assert restarted == driven
    assert driven["scale_x_doubt"] < 0.5 * new["scale_x_doubt"]


def test_nonsense_in_the_settings_is_left_out() -> None:
    noise, bias = LearntNoise(OdometryNoise()), LearntBias()
    before = noise.kept, bias.kept
    for restored in (noise, bias):
        restored.restore({"way_factor": float("nan"), "yaw_factor": "9", "turn": None, "scale_x": True})
    assert (noise.kept, bias.kept) == before
    noise.restore({"way_factor": 1e30})
    bias.restore({"scale_x": -5.0})
    assert noise.way_factor == FACTOR_MAX**2
    assert bias.scale_x == -SCALE_BIAS_MAX


def test_gyro_drift_and_wrong_wheels_are_learnt_fast() -> None:
    """Ten corrections by scans that see everything; afterwards a wrong one changes little."""
    bias, doubt, moved = LearntBias(), Doubt(way=1e-6, yaw=1e-7), Pose(0.05)
    for _ in range(10):
        missing = bias.missing(moved, 0.1)
        correction = Pose(0.04 * moved.x - missing.x, 0.0, 0.01 * 0.1 - missing.yaw)
        bias.learn(moved, 0.1, correction, (1.0, 1.0), doubt)
    assert bias.turn == pytest.approx(0.01, rel=0.05)
    assert bias.scale_x == pytest.approx(0.04, rel=0.05)
    known = bias.turn
    bias.learn(moved, 0.1, Pose(yaw=0.002), (1.0, 1.0), doubt)
    assert abs(bias.turn - known) < 0.002


def test_restored_doubt_allows_for_other_wheels() -> None:
    learnt, restarted, doubtful = LearntBias(), LearntBias(), LearntBias()
    for _ in range(50):
        learnt.learn(Pose(0.05), 0.1, Pose(), (1.0, 1.0), Doubt(way=1e-6, yaw=1e-7))
    restarted.restore(learnt.kept)
    assert learnt.kept["scale_x_doubt"] == SCALE_KEPT
    assert restarted.kept == learnt.kept
    ahead, aside = (restarted.spread(np.zeros((3, 3)), moved, 0.0)[0, 0] for moved in (Pose(0.05), Pose(0.0, 0.05)))
    assert ahead == pytest.approx((0.05 * SCALE_KEPT) ** 2)
    assert aside == pytest.approx((0.05 * SCALE_UNKNOWN) ** 2)  # it never moved sideways
    assert restarted.spread(np.zeros((3, 3)), Pose(), 1.0)[2, 2] == pytest.approx(TURN_UNKNOWN**2)
    doubtful.restore({"scale_x_doubt": 0.0, "scale_y_doubt": 9.0})
    assert doubtful.kept["scale_x_doubt"] == SCALE_KEPT
    assert doubtful.kept["scale_y_doubt"] == pytest.approx(SCALE_UNKNOWN)


def test_doubt_is_wide_before_learning() -> None:
    bias, moved = LearntBias(), Pose(0.05)
    before = bias.spread(np.zeros((3, 3)), moved, 0.1)
    for _ in range(10):
        bias.learn(moved, 0.1, Pose(), (1.0, 1.0), Doubt(way=1e-6, yaw=1e-7))
    after = bias.spread(np.zeros((3, 3)), moved, 0.1)
    assert before[0, 0] > 10 * after[0, 0] > 0.0
    assert before[2, 2] > 10 * after[2, 2] > 0.0
