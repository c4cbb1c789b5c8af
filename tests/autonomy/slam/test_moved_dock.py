"""A dock that people moved with the robot on it: the scan shows where it is now; the dock itself is not evidence."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.energy.battery import DockContact
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Pose
from roboglot.protocols.slamware.chapters.slam.composite import floors_of
from roboglot.simulation.world.world_files import WORLDS
from roboglot.storage.database import Database
from roboglot.wire.slamware.chapters.slam.stcm import decode_stcm
from tests.narrowing import known

MAP = Path(__file__).parents[3] / "examples" / "maps" / "office.stcm"  # in the world's frame
DOCK, BEFORE = "at = [22.5, 8.68], facing = 90", Pose(22.5, 8.935, math.pi / 2)


@pytest.mark.parametrize("shift", [-0.3, 0.3, -0.8, -2.0])
async def test_robot_on_a_moved_dock_finds_itself(shift: float, clock: LockstepClock, tmp_path: Path) -> None:
    office = (WORLDS / "office.toml").read_text()
    assert DOCK in office
    moved = tmp_path / "moved.toml"
    moved.write_text(office.replace(DOCK, DOCK.replace("22.5", str(22.5 + shift))))
    database = Database(":memory:")
    fleet = build_fleet(str(moved), [RobotConfig()], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot, truth = fleet.robots["a"], fleet.world.truth.pose_of("a")
    assert robot[DockContact].docked
    robot[Mapping].load(known(floors_of(decode_stcm(MAP.read_bytes()))[0].grid), BEFORE)
    await clock.advance(2.0)
    assert robot[Localization].lost is None
    assert robot[Localization].pose.distance_to(truth) < 0.05
    await fleet.close()
    database.close()
