"""``roboglot map``: loads and saves a robot's map (ROS or composite), builds maps from logs, and merges floors."""

from __future__ import annotations

import sys
import urllib.error
import urllib.request
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from msgspec.structs import astuple

from roboglot.cli.maps.merge import merged
from roboglot.cli.maps.ros_map import write_ros_map
from roboglot.cli.maps.survey import RADIUS, first_pose, surveyed
from roboglot.hosting.error_text import in_words
from roboglot.model.maps import OccupancyGrid
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap, composite_of, floors_of
from roboglot.simulation.world.world_files import load_world, read_ros_grid
from roboglot.text_files import bytes_of
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import MAP_BYTES_MAX, decode_stcm, encode_stcm

ANSWER_SECONDS_MAX = 30.0
COMPOSITE = ".stcm"
STCM = "/api/core/slam/v1/maps/stcm"
SAVED = "/api/multi-floor/map/v1/stcm"


class MapOperation(StrEnum):
    """Direction: to or from a robot or file, from a log, several floors to one, or a world's floors to one."""

    IMPORT = "import"
    EXPORT = "export"
    BUILD = "build"
    MERGE = "merge"
    SURVEY = "survey"


def command(
    way: Annotated[
        MapOperation,
        typer.Argument(
            help="import MAP, export to it, build from it (a log), merge floors into it, or survey a world."
        ),
    ],
    ros_map: Annotated[
        Path, typer.Argument(metavar="MAP", help="A ROS map's yaml file with its image beside it, a .stcm, or a log.")
    ],
    robot: Annotated[str, typer.Option(help="The robot's Slamware address.")] = "http://127.0.0.1:1448",
    file: Annotated[Path | None, typer.Option(help="A composite map (.stcm) instead of a robot.")] = None,
    out: Annotated[Path, typer.Option(help="build: the folder for map, trajectory and report.")] = Path("map"),
    relations: Annotated[Path | None, typer.Option(help="build: a relations file to measure against.")] = None,
    pose: Annotated[str, typer.Option(help="Where the robot is in an imported map: x,y,yaw in m and rad.")] = "",
    floor: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SOURCE",
            help="For merge, lowest first: a .stcm, a ROS map (.yaml) or a robot's http:// address.",
        ),
    ] = None,
    building: Annotated[str, typer.Option(help="For merge: the building's name.")] = "",
    world: Annotated[str, typer.Option(help="For survey: the world whose floors are drawn.")] = "office",
) -> None:
    """Give a robot a map, write its map to a file, build one from a log, or merge the maps of several floors."""
    floors = floor or []
    try:
        match way:
            case MapOperation.BUILD:
                from roboglot.cli.maps.build import build  # it needs the kernels

                build(ros_map, out, relations)
            case MapOperation.MERGE:
                ros_map.write_bytes(merged(floors, building, lambda address: _call(address, "GET", STCM)))
                print(f"{', '.join(floors)} -> {ros_map}")
            case MapOperation.SURVEY:
                _survey(world, ros_map)
            case MapOperation.IMPORT:
                _import(ros_map, robot, file, pose)
            case MapOperation.EXPORT:
                _export(robot, file, ros_map)
    except (ValueError, OSError) as error:  # BadMap, BadFile and the like carry plain messages
        sys.exit(f"roboglot map: {in_words(error)}")


def _survey(world: str, target: Path) -> None:
    description = load_world(world)
    target.write_bytes(surveyed(description))
    pose = ",".join(f"{value:.3f}" for value in astuple(first_pose(description, RADIUS)))
    print(f"{world} -> {target}; its first robot wakes up there at --pose {pose}")


def _import(source: Path, robot: str, file: Path | None, pose: str) -> None:
    data = _read(source)
    if file:
        file.write_bytes(data)
    else:
        _give(robot, data, pose)
    print(f"{source} -> {file or robot}")


def _export(robot: str, file: Path | None, target: Path) -> None:
    data = bytes_of(file, MAP_BYTES_MAX) if file else _call(robot, "GET", STCM)
    if target.suffix == COMPOSITE:
        target.write_bytes(data)
    else:
        write_ros_map(grid_in(data), target)
    print(f"{file or robot} -> {target}")


def _read(path: Path) -> bytes:
    """Return a map file as a composite map. Raises BadMap, ValueError, OSError."""
    if path.suffix != COMPOSITE:
        return encode_stcm(composite_of(FloorMap(grid=read_ros_grid(path))))
    data = bytes_of(path, MAP_BYTES_MAX)
    floors_of(decode_stcm(data))
    return data


def grid_in(data: bytes) -> OccupancyGrid:
    """Return the first grid in a composite map. Raises BadMap."""
    grid = next((floor.grid for floor in floors_of(decode_stcm(data)) if floor.grid is not None), None)
    if grid is None or not grid.width:
        raise BadMap("the map is empty")
    return grid


def _give(robot: str, data: bytes, pose: str) -> None:
    """Save the map on the robot and load it."""
    body = b""
    if pose:
        numbers = [float(text) for text in pose.split(",")]
        if len(numbers) != 3:
            raise ValueError(f"a pose is x,y,yaw, not {pose}")
        body = msgspec.json.encode({"pose": dict(zip(("x", "y", "yaw"), numbers, strict=True))})
    _call(robot, "POST", SAVED, data)
    _call(robot, "POST", f"{SAVED}/:reload", body)


def _call(robot: str, method: str, path: str, body: bytes | None = None) -> bytes:
    if not robot.startswith(("http://", "https://")):
        raise ValueError(f"a robot's address begins with http://, not {robot}")
    request = urllib.request.Request(f"{robot.rstrip('/')}{path}", body, method=method)
    try:
        with urllib.request.urlopen(request, timeout=ANSWER_SECONDS_MAX) as answer:
            data = bytes(answer.read(MAP_BYTES_MAX + 1))
    except urllib.error.HTTPError as error:
        with error:
            raise ValueError(f"the robot answers {error.code} {error.reason}: {error.read(500).decode()}") from None
    except urllib.error.URLError as error:
        raise OSError(f"{robot} does not answer: {error.reason}") from None
    if len(data) > MAP_BYTES_MAX:
        raise BadMap(f"the robot's answer has more than {MAP_BYTES_MAX} bytes")
    return data
