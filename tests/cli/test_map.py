"""ROS maps there and back, and through a robot's door."""

from __future__ import annotations

import asyncio
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from roboglot.cli.map import grid_in, write_ros_map
from roboglot.config import SlamwareConfig
from roboglot.model.components.localization import Localization
from roboglot.model.components.mapping import Mapping
from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.ros_map import read_ros_grid
from roboglot.testing import Forward
from roboglot.wire.slamware.explore_map import BadMap
from roboglot.wire.slamware.stcm import CompositeMap, encode_stcm

CELLS = np.array([[0, -50, 60], [1, -1, 0], [-127, 127, 0]], np.int8)
PATIENCE = 60.0  # s of the machine's time
GRID = OccupancyGrid(CELLS, 0.05, Point(-1.25, 2.5))


async def roboglot(*arguments: str) -> tuple[int, str]:
    """A real ``roboglot map``; its exit code and what it said."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "roboglot", "map", *arguments,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, env=os.environ | {"COLUMNS": "200"},
    )  # fmt: skip
    try:
        said, _ = await asyncio.wait_for(process.communicate(), PATIENCE)
    finally:
        if process.returncode is None:
            process.kill()
    return process.returncode or 0, said.decode()


def test_a_written_map_is_read_again(tmp_path: Path) -> None:
    write_ros_map(GRID, tmp_path / "m.yaml")
    again = read_ros_grid(tmp_path / "m.yaml")
    assert (np.sign(again.log_odds) == np.sign(CELLS)).all()
    assert (again.resolution, again.origin) == (0.05, GRID.origin)
    assert (tmp_path / "m.pgm").read_bytes().startswith(b"P5\n3 3\n255\n")


def test_a_composite_map_without_a_grid_is_no_map() -> None:
    with pytest.raises(BadMap):
        grid_in(encode_stcm(CompositeMap()))


async def test_files_there_and_back(tmp_path: Path) -> None:
    write_ros_map(GRID, tmp_path / "m.yaml")
    code, said = await roboglot("import", str(tmp_path / "m.yaml"), "--file", str(tmp_path / "m.stcm"))
    assert code == 0, said
    code, said = await roboglot("export", str(tmp_path / "again.yaml"), "--file", str(tmp_path / "m.stcm"))
    assert code == 0, said
    assert (tmp_path / "again.pgm").read_bytes() == (tmp_path / "m.pgm").read_bytes()
    code, said = await roboglot("export", str(tmp_path / "x.yaml"), "--file", str(tmp_path / "nothing"))
    assert code == 1
    assert said.startswith("roboglot map:")


@pytest.mark.world("empty")
async def test_a_robot_takes_a_ros_map_and_gives_its_own(robot: Robot, forward: Forward, tmp_path: Path) -> None:
    await forward(seconds=1)
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    address = door.endpoints[0].address
    code, said = await roboglot("export", str(tmp_path / "own.yaml"), "--robot", address)
    assert code == 0, said
    own = robot[Mapping].grid
    assert (np.sign(read_ros_grid(tmp_path / "own.yaml").log_odds) == np.sign(own.log_odds)).all()

    robot[Mapping].clear()
    code, said = await roboglot("import", str(tmp_path / "own.yaml"), "--robot", address, "--pose", "0.5,0.25,0")
    assert code == 0, said
    assert (np.sign(robot[Mapping].grid.log_odds) == np.sign(own.log_odds)).all()
    assert robot[Localization].pose.x == pytest.approx(0.5)
    await door.close()
