"""``roboglot map``: loads and saves a robot's map (ROS or composite), builds maps from logs, and merges floors."""

from __future__ import annotations

import http.client
import math
import sys
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated

import msgspec
import typer
from msgspec.structs import astuple

from roboglot.cli.maps.merge import merged
from roboglot.cli.maps.ros_map import write_ros_map
from roboglot.cli.maps.survey import RADIUS, first_pose, surveyed
from roboglot.cli.suggestions import Group
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

app = typer.Typer(
    cls=Group,
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    help="Give a robot a map, write its map to a file, build one from a log, merge floors, or survey a world.",
)
Robot = Annotated[str, typer.Option(help="The robot's Slamware address.")]
Composite = Annotated[Path | None, typer.Option(help="A composite map (.stcm) instead of a robot.")]
Target = Annotated[Path, typer.Argument(metavar="MAP", help="The new map (.stcm).")]
SLAMWARE = "http://127.0.0.1:1448"


@contextmanager
def _one_line() -> Iterator[None]:
    """Context whose errors end the program with one line."""
    try:
        yield
    except (ValueError, OSError) as error:  # BadMap, BadFile and the like carry plain messages
        sys.exit(f"roboglot map: {in_words(error)}")


@app.command(name="import")
def import_map(
    source: Annotated[
        Path, typer.Argument(metavar="MAP", help="A ROS map's yaml file with its image beside it, or a .stcm.")
    ],
    robot: Robot = SLAMWARE,
    file: Composite = None,
    pose: Annotated[str, typer.Option(help="Where the robot is in the map: x,y,yaw in m and rad.")] = "",
) -> None:
    """Give a robot a map, or write it to a composite map."""
    with _one_line():
        numbers = _numbers(pose) if pose else []
        if file:
            _check_name(file, COMPOSITE)
            if pose:
                raise ValueError("--pose is for robots: a file keeps none")
        data = _read(source)
        if file:
            _write(file, data)
        else:
            _give(robot, data, numbers)
        print(f"{source} -> {file or robot}")


@app.command()
def export(
    target: Annotated[
        Path, typer.Argument(metavar="MAP", help="The new ROS map (.yaml; its image is put beside it), or a .stcm.")
    ],
    robot: Robot = SLAMWARE,
    file: Composite = None,
    floor: Annotated[str, typer.Option(help="Name of the floor, if the map has several: a ROS map has one.")] = "",
) -> None:
    """Write a robot's map, or a composite map, to a file."""
    with _one_line():
        _check_name(target, ROS + COMPOSITE)
        if floor and target.suffix in COMPOSITE:
            raise ValueError("--floor is for ROS maps: a .stcm holds all floors")
        data = bytes_of(file, MAP_BYTES_MAX) if file else _call(robot, "GET", STCM)
        if target.suffix in COMPOSITE:
            _write(target, data)
        else:
            write_ros_map(grid_in(data, floor), target)
        print(f"{file or robot} -> {target}")


@app.command()
def build(
    log: Annotated[Path, typer.Argument(help="The log of a drive: CARMEN, a bag of ROS, or our own recording.")],
    out: Annotated[Path, typer.Option(help="The folder for map, trajectory and report.")] = Path("map"),
    relations: Annotated[Path | None, typer.Option(help="A relations file to measure against.")] = None,
) -> None:
    """Build a map from a recorded drive."""
    from roboglot.cli.maps.build import build as build_map  # it needs the kernels

    with _one_line():
        build_map(log, out, relations)


@app.command()
def merge(
    target: Target,
    floor: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=SOURCE",
            help="A floor, the lowest first; its source is a .stcm, a ROS map (.yaml) or a robot's http:// address.",
        ),
    ] = None,
    building: Annotated[str, typer.Option(help="The building's name.")] = "",
) -> None:
    """Merge the maps of several floors."""
    floors = floor or []
    with _one_line():
        _check_name(target, COMPOSITE)
        _write(target, merged(floors, building, lambda address: _call(address, "GET", STCM)))
        print(f"{', '.join(floors)} -> {target}")


@app.command()
def survey(
    target: Target,
    world: Annotated[str, typer.Option(help="The world whose floors are drawn.")] = "office",
) -> None:
    """Draw a map of a world's floors."""
    with _one_line():
        _check_name(target, COMPOSITE)
        description = load_world(world)
        _write(target, surveyed(description))
        pose = ",".join(f"{value:.3f}" for value in astuple(first_pose(description, RADIUS)))
        print(f"{world} -> {target}; its first robot wakes up there at --pose {pose}")


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


def grid_in(data: bytes, name: str = "") -> OccupancyGrid:
    """Return the only grid in a composite map, or that of the floor of this name. Raises BadMap, ValueError."""
    grids = [(floor.name.floor, floor.grid) for floor in floors_of(decode_stcm(data)) if floor.grid is not None]
    grids = [(floor, grid) for floor, grid in grids if grid.width]
    if not grids:
        raise BadMap("the map is empty")
    there = ", ".join(floor for floor, _ in grids)
    found = [grid for floor, grid in grids if name in ("", floor)]
    if not found:
        raise ValueError(f"the map has no floor {name!r}; there are: {there}")
    if len(found) > 1:
        raise ValueError(f"the map has several floors: give --floor with one of {there}")
    return found[0]


def _give(robot: str, data: bytes, pose: list[float]) -> None:
    """Save the map on the robot and load it; ``pose`` is empty, or x and y (m) and yaw (rad)."""
    body = msgspec.json.encode({"pose": dict(zip(("x", "y", "yaw"), pose, strict=True))}) if pose else b""
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
