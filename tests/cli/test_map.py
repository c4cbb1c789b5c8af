"""ROS maps there and back, and through a robot's door."""

from __future__ import annotations

import asyncio
import errno
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from roboglot.cli import map as commands
from roboglot.cli.map import grid_in, write_ros_map
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid, PointOfInterest
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import (
    FloorMap,
    FloorName,
    composite_of,
    floors_of,
)
from roboglot.protocols.slamware.config import SlamwareConfig
from roboglot.protocols.slamware.server import SlamwareDoor
from roboglot.simulation.world.world_files import read_ros_grid
from roboglot.testing import Forward
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap, Layer, decode_stcm, encode_stcm

CELLS = np.array([[0, -50, 60], [1, -1, 0], [-127, 127, 0]], np.int8)
PATIENCE = 60.0  # s of the machine's time
GRID = OccupancyGrid(CELLS, 0.05, Point(-1.25, 2.5))


async def roboglot(*arguments: str, folder: Path | None = None) -> tuple[int, str]:
    """Run ``roboglot map``; return its exit code and its output."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-m", "roboglot", "map", *arguments,
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, cwd=folder, env=os.environ | {"COLUMNS": "200"},
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


def test_map_that_fills_the_disk_leaves_the_old(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_ros_map(GRID, tmp_path / "m.yaml")
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    write = Path.write_bytes

    def fail(path: Path, data: bytes) -> int:
        if "pgm" in path.name:
            write(path, data[:1])
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", fail)
    with pytest.raises(OSError, match="No space"):
        write_ros_map(OccupancyGrid(-CELLS, 0.1, Point(0.0, 0.0)), tmp_path / "m.yaml")
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


def test_composite_map_without_a_grid_is_no_map() -> None:
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


@pytest.mark.parametrize(
    ("run", "name", "options", "words"),
    [
        (commands.export, "m.pgm", {}, "ends in .yaml or .yml or .stcm, not 'm.pgm'"),
        (commands.export, "noext", {}, "not 'noext'"),
        (commands.import_map, "m.pgm", {}, "not 'm.pgm'"),
        (commands.import_map, "m.yaml", {"file": Path("out.yaml")}, "ends in .stcm, not 'out.yaml'"),
        (commands.merge, "out.yaml", {"floor": ["1F=m.yaml"]}, "ends in .stcm, not 'out.yaml'"),
        (commands.survey, "office.yaml", {}, "ends in .stcm, not 'office.yaml'"),
        (commands.export, "x.stcm", {"floor": "1F"}, "--floor is for ROS maps"),
        (commands.import_map, "bad.stcm", {}, "bad.stcm: "),
        (commands.import_map, "m.yaml", {"pose": "1,2"}, "a pose is x,y,yaw"),
        (commands.import_map, "m.yaml", {"pose": "1,2,0", "file": Path("out.stcm")}, "--pose is for robots"),
        (commands.import_map, "m.yaml", {"pose": "1,2,nan"}, "a pose is x,y,yaw"),
        (commands.import_map, "m.yaml", {"pose": "1,2,north"}, "a pose is x,y,yaw"),
        (commands.export, "x.yaml", {"robot": "http://a b"}, "'http://a b' is no address"),
        (commands.export, "x.yaml", {"robot": f"http://{'a' * 64}.example"}, "is no address"),
    ],
)
def test_mistakes_are_named_and_overwrite_nothing(
    run: Callable[..., None],
    name: str,
    options: dict[str, Any],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    write_ros_map(GRID, tmp_path / "m.yaml")
    (tmp_path / "bad.stcm").write_bytes(encode_stcm(composite_of(FloorMap(grid=GRID)))[:200])
    before = {file.name: file.read_bytes() for file in tmp_path.iterdir()}
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match=re.escape(words)):
        run(Path(name), **options)
    assert {file.name: file.read_bytes() for file in tmp_path.iterdir()} == before


async def test_port_of_another_door_is_named(tmp_path: Path) -> None:
    async def greet(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"ok;\n")
        writer.close()

    server = await asyncio.start_server(greet, "127.0.0.1", 0)
    address = f"http://127.0.0.1:{server.sockets[0].getsockname()[1]}"
    code, said = await roboglot("export", str(tmp_path / "x.yaml"), "--robot", address)
    assert code == 1
    assert said.startswith(f"roboglot map: {address} does not answer as a Slamware door: ")
    server.close()


def test_one_of_several_floors_is_chosen(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    other = OccupancyGrid(-CELLS, 0.05, GRID.origin)
    write_ros_map(GRID, Path("ground.yaml"))
    write_ros_map(other, Path("first.yaml"))
    commands.merge(Path("both.stcm"), floor=["1F=ground.yaml", "2F=first.yaml"])
    commands.export(Path("up.yaml"), file=Path("both.stcm"), floor="2F")
    assert Path("up.pgm").read_bytes() == Path("first.pgm").read_bytes()
    for floor, words in ("", "one of 1F, 2F"), ("3F", "no floor '3F'"):
        with pytest.raises(SystemExit, match=words):
            commands.export(Path("no.yaml"), file=Path("both.stcm"), floor=floor)
    assert not Path("no.yaml").exists()


@pytest.mark.world("empty")
async def test_robot_takes_ros_map_and_gives_its_own(robot: Robot, forward: Forward, tmp_path: Path) -> None:
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


async def test_merged_floors_are_floors_of_the_robot(
    robot: Robot, clock: LockstepClock, forward: Forward, tmp_path: Path
) -> None:
    await forward(seconds=2)
    door = SlamwareDoor(robot, "127.0.0.1", SlamwareConfig(port=0))
    await door.start()
    address = door.endpoints[0].address
    strange = Layer((("usage", "unknown"), ("building", "B"), ("floor", "9F")), b"?")
    place = PointOfInterest("p", Pose(1.0, 0.5), {"display_name": "upstairs"})
    upper = FloorMap(FloorName("B", "9F"), GRID, places=(place,), layers=(strange,))
    (tmp_path / "upper.stcm").write_bytes(encode_stcm(composite_of(upper)))
    write_ros_map(GRID, tmp_path / "cellar.yaml")
    tower = tmp_path / "tower.stcm"
    floors = ("-1F=cellar.yaml", f"1F={address}", "2F=upper.stcm")
    code, said = await roboglot(
        "merge", str(tower), "--building", "T", *(f"--floor={floor}" for floor in floors), folder=tmp_path
    )
    assert code == 0, said
    read = floors_of(decode_stcm(tower.read_bytes()))
    assert [(f.name.building, f.name.floor, f.name.default) for f in read] == [
        ("T", "-1F", True),
        ("T", "1F", False),
        ("T", "2F", False),
    ]
    assert [layer.payload for layer in read[2].layers] == [b"?"]
    importing = asyncio.ensure_future(roboglot("import", str(tower), "--robot", address, "--pose", "0,0,0"))
    while not importing.done():
        await asyncio.sleep(0.01)
        await forward(seconds=0.1)
    assert (await importing)[0] == 0, await importing
    async with httpx.AsyncClient(base_url=address, verify=False) as client:
        listed = (await client.get("/api/multi-floor/map/v1/floors")).json()
        assert [entry["floor"] for entry in listed] == ["-1F", "1F", "2F"]
        (found,) = (await client.get("/api/multi-floor/map/v1/pois", params={"floor": "2F", "building": "T"})).json()
        assert found["poi_name"] == "upstairs"
    await door.close()


def test_merged_floors_have_docks_of_their_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    dock = PointOfInterest("home dock of this robot", Pose(1.0), {"display_name": "home"})
    floor = FloorMap(FloorName(), GRID, Annotations(docks=(dock,)))
    (tmp_path / "one.stcm").write_bytes(encode_stcm(composite_of(floor)))
    monkeypatch.chdir(tmp_path)
    commands.merge(Path("both.stcm"), floor=["1F=one.stcm", "2F=one.stcm"])
    below, above = (floor.annotations.docks[0].id for floor in floors_of(decode_stcm(Path("both.stcm").read_bytes())))
    assert below == dock.id
    assert above != below


@pytest.mark.parametrize(
    ("floors", "words"),
    [
        ([], "1 to 100 floors"),
        (["1F"], "NAME=SOURCE"),
        (["1F=m.yaml", "1F=m.yaml"], "two floors"),
        (["1F=nothing.stcm"], "nothing.stcm"),
        (["1F=m.yaml", "2F=http://127.0.0.1:9"], "does not answer"),
    ],
)
def test_failed_merge_is_one_sentence(
    floors: list[str], words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_ros_map(GRID, tmp_path / "m.yaml")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SystemExit, match=words):
        commands.merge(Path("out.stcm"), floor=floors)
    assert not (tmp_path / "out.stcm").exists()
