"""``roboglot map``: loads and saves a robot's map (ROS or composite), builds maps from logs, and merges floors."""

from __future__ import annotations

import http.client
import math
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
from roboglot.text_files import bytes_of, replacing
from roboglot.wire.slamware.chapters.slam.explore_map import BadMap
from roboglot.wire.slamware.chapters.slam.stcm import MAP_BYTES_MAX, decode_stcm, encode_stcm

ANSWER_SECONDS_MAX = 30.0
COMPOSITE, ROS = (".stcm",), (".yaml", ".yml")  # the ends of the files' names
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
            help="For merge, lowest first: a .stcm, a ROS map (.yaml) or a robot's http:// address."
            " For export to a ROS map: the NAME of one floor of several.",
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
                _check_name(ros_map, COMPOSITE)
                _write(ros_map, merged(floors, building, lambda address: _call(address, "GET", STCM)))
                print(f"{', '.join(floors)} -> {ros_map}")
            case MapOperation.SURVEY:
                _survey(world, ros_map)
            case MapOperation.IMPORT:
                _import(ros_map, robot, file, pose)
            case MapOperation.EXPORT:
                _export(robot, file, ros_map, floors)
    except (ValueError, OSError) as error:  # BadMap, BadFile and the like carry plain messages
        sys.exit(f"roboglot map: {in_words(error)}")


def _survey(world: str, target: Path) -> None:
    _check_name(target, COMPOSITE)
    description = load_world(world)
    _write(target, surveyed(description))
    pose = ",".join(f"{value:.3f}" for value in astuple(first_pose(description, RADIUS)))
    print(f"{world} -> {target}; its first robot wakes up there at --pose {pose}")


def _import(source: Path, robot: str, file: Path | None, pose: str) -> None:
    if file:
        _check_name(file, COMPOSITE)
    data = _read(source)
    if file:
        _write(file, data)
    else:
        _give(robot, data, pose)
    print(f"{source} -> {file or robot}")


def _export(robot: str, file: Path | None, target: Path, floors: list[str]) -> None:
    _check_name(target, ROS + COMPOSITE)
    data = bytes_of(file, MAP_BYTES_MAX) if file else _call(robot, "GET", STCM)
    if target.suffix in COMPOSITE:
        _write(target, data)
    else:
        write_ros_map(grid_in(data, *floors), target)
    print(f"{file or robot} -> {target}")


def _check_name(path: Path, ends: tuple[str, ...]) -> None:
    """Raise ValueError unless the name of a map's file ends like one."""
    if path.suffix not in ends:
        raise ValueError(f"the name of such a map ends in {' or '.join(ends)}, not {path.name!r}")


def _write(target: Path, data: bytes) -> None:
    with replacing(target) as fresh:
        fresh.write_bytes(data)


def _read(path: Path) -> bytes:
    """Return a map file as a composite map. Raises BadMap, ValueError, OSError."""
    _check_name(path, ROS + COMPOSITE)
    if path.suffix in ROS:
        return encode_stcm(composite_of(FloorMap(grid=read_ros_grid(path))))
    data = bytes_of(path, MAP_BYTES_MAX)
    try:
        floors_of(decode_stcm(data))
    except ValueError as error:
        raise BadMap(f"{path}: {error}") from None
    return data


def grid_in(data: bytes, *names: str) -> OccupancyGrid:
    """Return the only grid in a composite map, or that of the floor of this name. Raises BadMap, ValueError."""
    if len(names) > 1:
        raise ValueError("a ROS map has one floor: give one --floor")
    grids = [(floor.name.floor, floor.grid) for floor in floors_of(decode_stcm(data)) if floor.grid is not None]
    grids = [(name, grid) for name, grid in grids if grid.width]
    if not grids:
        raise BadMap("the map is empty")
    there = ", ".join(name for name, _ in grids)
    found = [grid for name, grid in grids if name in names] if names else [grid for _, grid in grids]
    if names and not found:
        raise ValueError(f"the map has no floor {names[0]!r}; there are: {there}")
    if len(found) > 1:
        raise ValueError(f"the map has several floors: give --floor with one of {there}")
    return found[0]


def _give(robot: str, data: bytes, pose: str) -> None:
    """Save the map on the robot and load it."""
    body = b""
    if pose:
        body = msgspec.json.encode({"pose": dict(zip(("x", "y", "yaw"), _numbers(pose), strict=True))})
    _call(robot, "POST", SAVED, data)
    _call(robot, "POST", f"{SAVED}/:reload", body)


def _numbers(pose: str) -> list[float]:
    """Return x and y (m) and yaw (rad) of a pose's text. Raises ValueError."""
    try:
        x, y, yaw = map(float, pose.split(","))
    except ValueError:
        x = y = yaw = math.nan
    if not math.isfinite(x + y + yaw):
        raise ValueError(f"a pose is x,y,yaw (m, rad), not {pose!r}")
    return [x, y, yaw]


def _call(robot: str, method: str, path: str, body: bytes | None = None) -> bytes:
    if not robot.startswith(("http://", "https://")):
        raise ValueError(f"a robot's address begins with http://, not {robot}")
    request = urllib.request.Request(f"{robot.rstrip('/')}{path}", body, method=method)
    try:
        with urllib.request.urlopen(request, timeout=ANSWER_SECONDS_MAX) as answer:
            data = bytes(answer.read(MAP_BYTES_MAX + 1))
    except urllib.error.HTTPError as error:
        with error:
            said = error.read(500).decode(errors="replace").strip()
            raise ValueError(f"the robot answers {error.code} {error.reason}: {said}") from None
    except urllib.error.URLError as error:
        raise OSError(f"{robot} does not answer: {error.reason}") from None
    except (http.client.InvalidURL, UnicodeError) as error:
        raise ValueError(f"{robot!r} is no address: {error}") from None
    except (http.client.HTTPException, ConnectionError) as error:
        raise OSError(f"{robot} does not answer as a Slamware door: {error or type(error).__name__}") from None
    if len(data) > MAP_BYTES_MAX:
        raise BadMap(f"the robot's answer has more than {MAP_BYTES_MAX} bytes")
    return data
