"""Closing loops with a short-sighted lidar and bad odometry around a block: judged by the world."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.localization import Localization
from roboglot.model.components.mapping import Mapping
from roboglot.model.components.navigation import Navigation, NavigationOptions
from roboglot.model.events import LoopClosed
from roboglot.model.geometry import Pose
from roboglot.simulation.body import BODIES
from roboglot.storage.database import Database

RING = str(Path(__file__).parent / "ring.toml")
LAP = [(1.3, 1.3), (16.0, 1.3), (30.7, 1.3), (30.7, 12.0), (30.7, 22.7), (16.0, 22.7), (1.3, 22.7), (1.3, 12.0),
       (1.3, 4.5), (1.4, 1.4), (5.0, 1.3), (8.0, 1.3)]  # fmt: skip


def short_sighted(folder: Path) -> str:
    text = (BODIES / "universal.toml").read_text()
    for key, value in (("scale_error", 0.06), ("range_max", 5.0), ("gyro_bias", 0.01)):
        text = re.sub(rf"(?m)^{key} = [\d.]+", f"{key} = {value}", text, count=1)
    path = folder / "short_sighted.toml"
    path.write_text(text)
    return str(path)


@pytest.mark.parametrize("closing", [True, False])
async def test_a_loop_is_closed_and_the_map_straightened(tmp_path: Path, closing: bool) -> None:
    clock, database = LockstepClock(), Database(":memory:")
    robots = [RobotConfig(body=short_sighted(tmp_path))]
    fleet = build_fleet(RING, robots, clock=clock, seed=2, database=database)
    await fleet.start(wait=True)
    robot, start, closed, errors = fleet.robots["a"], fleet.world.pose_of("a"), [], []
    robot.events.listen(LoopClosed, closed.append)
    visited: list[tuple[Pose, Pose]] = []  # where it believed to be, and was
    robot[Mapping].close_loops(closing)
    assert robot[Mapping].closes_loops is closing
    for spot in LAP:
        goal = Pose(*spot).relative_to(start).point
        action = robot[Navigation].navigate_to([goal], NavigationOptions(tolerance=0.5, retries=3))
        while not action.status.ended:
            await clock.advance(0.5)
            if not closed:
                visited.append((robot[Localization].pose, fleet.world.pose_of("a").relative_to(start)))
            errors.append(start.compose(robot[Localization].pose).distance_to(fleet.world.pose_of("a")))
    await fleet.close()
    database.close()
    assert max(errors) > 0.3  # otherwise this proves nothing
    assert bool(closed) is closing
    settled = float(np.mean(errors[-10:]))
    if closing:
        assert closed[0].shift > 0.2
        assert settled < 0.08
        kept = [believed.distance_to(true) for believed, true in visited]
        moved = [_moved(believed, closed[0].moved).distance_to(true) for believed, true in visited]
        assert float(np.mean(moved)) < 0.85 * float(np.mean(kept))  # the map is truer all over, and it tells how
    else:
        assert settled > 0.2


def _moved(pose: Pose, moved: Sequence[tuple[Pose, Pose]]) -> Pose:
    before, after = min(moved, key=lambda pair: pair[0].distance_to(pose))
    return after.compose(pose.relative_to(before))
