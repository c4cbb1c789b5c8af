"""Glass lets a lidar look through, a mirror shows the room again; a body with clean sensors sees walls."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.geometry import Pose
from roboglot.simulation.world import reflections
from roboglot.storage.database import Database

ROOM = """
name = "gloss"
[[floors]]
name = "gloss"
size = [10, 8]
walls = [
    { from = [7, 0.5], to = [7, 7.5], material = "glass" },
    { from = [1, 7], to = [6, 7], material = "mirror" },
]
"""
EYE = Pose(4.0, 4.0)


async def ranges_at(file: Path, body: str) -> NDArray[np.float32]:
    """Return a scan from EYE; ray i points to -180 + i degrees."""
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet(str(file), [RobotConfig(body=body)], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    fleet.world.stage.place("a", EYE)
    await clock.advance(0.5)
    scan = fleet.robots["a"][Lidar].scan
    assert scan is not None
    await fleet.close()
    database.close()
    return scan.ranges


async def test_glass_and_mirrors_matter_unless_sensors_are_clean(tmp_path: Path) -> None:
    file = tmp_path / "reflections.toml"
    file.write_text(ROOM)
    usual, clean = await ranges_at(file, "universal"), await ranges_at(file, "universal+clean")
    assert (usual[180], clean[180]) == (pytest.approx(2.94, abs=0.05), pytest.approx(2.94, abs=0.05))  # square
    slant = math.cos(math.radians(25.0))
    assert usual[205] == pytest.approx(6.0 / slant, abs=0.06)  # through the glass, to the outer wall
    assert clean[205] == pytest.approx(2.94 / slant, abs=0.06)
    assert clean[300] == pytest.approx(2.94 / math.cos(math.radians(30.0)), abs=0.06)
    assert usual[300] == pytest.approx(
        4.0 / math.sin(math.radians(30.0)), abs=0.06
    )  # by the mirror to the wall at x = 0
    assert usual[270] == pytest.approx(2 * 2.94 - 0.25, abs=0.06)  # itself


def test_rays_that_meet_nothing_return_nothing() -> None:
    none, eye, way = np.empty((0, 4)), np.zeros((1, 2)), np.array([[1.0, 0.0]])
    mirror = np.array([[2.0, 1.0, 2.0, -1.0]])  # seen from the left
    behind = np.array([np.inf])
    assert np.isinf(reflections.seen(behind, none, mirror, none, none, eye, way)).all()
    assert np.isinf(reflections.seen(behind, none, mirror[:, [2, 3, 0, 1]], none, none, eye, way)).all()
    ball = np.array([[-3.0, 0.0, 0.5, 0.0]])
    assert reflections.seen(behind, none, mirror, none, ball, eye, way) == pytest.approx([2.0 + 5.0 - 0.5])
