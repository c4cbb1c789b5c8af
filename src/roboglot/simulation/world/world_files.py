"""Finds worlds: shipped, the user's own, or a ROS map (``yaml`` beside an image, as map_server saves it) as one floor.

Occupied cells become walls, exactly; unknown cells are empty space. A dock is put in a roomy place.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated, Literal

import msgspec
import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.geometry import Point
from roboglot.model.maps import OccupancyGrid
from roboglot.simulation.building.rectangles import cover
from roboglot.simulation.world.declarations import BadFile, read_toml, text_below
from roboglot.simulation.world.description import (
    SOLIDS_MAX,
    AccessPoint,
    Box,
    Coordinate,
    Dock,
    Floor,
    Spot,
    Wall,
    WorldDescription,
)
from roboglot.simulation.world.description_checks import completed
from roboglot.spelling import instead
from roboglot.text_files import parse_yaml, tables_in
from roboglot.validation import why_invalid

WORLDS = Path(__file__).parent.parent / "worlds"
CELLS_MAX = 16_000_000
ROS_MAP_BYTES_MAX = 64 << 10  # of the yaml, which has six fields
IMAGES = ("PPM", "PNG", "BMP", "GIF", "JPEG", "TIFF")  # not EPS, which Pillow has Ghostscript run as a program
DEEP = 257  # a grey value of 16 bits for each of 8: 65535 is 255
HEIGHT = 2.5
WALL_LENGTH = 1.0  # m from which a solid counts as a wall rather than an object
ROOM = (2.0, 1.5, 1.0, 0.75, 0.6, 0.5)  # m of free floor around a robot that leaves its dock; the first that exists
DOCK_TO_START = 0.3  # m from the dock's front to the centre of that space

Cells = NDArray[np.bool_]


class RosMap(Struct, frozen=True):
    """Fields of the ``yaml``; the image's first row is the map's highest y."""

    image: str
    resolution: Annotated[float, Meta(gt=0.001, le=1.0)]
    origin: tuple[Coordinate, Coordinate, float]
    occupied_thresh: Annotated[float, Meta(ge=0, le=1)]
    free_thresh: Annotated[float, Meta(ge=0, le=1)]
    negate: Literal[0, 1] = 0
    mode: Literal["trinary", "scale", "raw"] = "trinary"


def load_world(name_or_path: str | Path) -> WorldDescription:
    """Load a shipped world by name, a TOML file, or a ROS map (yaml). Raises BadFile (a ValueError)."""
    name = str(name_or_path)
    known = [file.stem for file in tables_in(WORLDS)]
    path = WORLDS / f"{name}.toml" if name in known else Path(name)
    match path.suffix:
        case ".toml":
            return completed(read_toml(path, WorldDescription), str(path))
        case ".yaml" | ".yml":
            return completed(import_ros_map(path), str(path))
        case _:
            raise BadFile(f"no world is named {name!r}, and it is not a .toml or .yaml file{instead(name, known)}")


def world_sources(name_or_path: str) -> list[Path]:
    """Return the files of a world: its TOML file, or a ROS map and its image."""
    shipped = WORLDS / f"{name_or_path}.toml"
    path = shipped if shipped in tables_in(WORLDS) else Path(name_or_path)
    return [path] if path.suffix == ".toml" else [path, path.parent / _read(path).image]


def import_ros_map(path: Path) -> WorldDescription:
    """Return a ROS map as a world of one floor. Raises BadFile."""
    ros_map = _read(path)
    occupied, free = _cells(ros_map, _pixels(path.parent / ros_map.image))
    if not free.any():
        raise BadFile(f"{path}: the map has no free cell")
    walls, things = _solids(ros_map, occupied, path)
    middle, facing = _place_for_dock(ros_map, free, path)
    floor = Floor(
        name=path.stem,
        size=(free.shape[1] * ros_map.resolution, free.shape[0] * ros_map.resolution),
        origin=ros_map.origin[:2],
        height=HEIGHT,
        walls=walls,
        furniture=things,
        docks=(Dock(at=middle, facing=facing),),
        access_points=(AccessPoint(at=middle),),
    )
    return WorldDescription(name=path.stem, floors=(floor,))


def read_ros_grid(path: Path) -> OccupancyGrid:
    """Return a ROS map as a robot's grid, with full certainty in every known cell. Raises BadFile."""
    ros_map = _read(path)
    occupied, free = _cells(ros_map, _pixels(path.parent / ros_map.image))
    log_odds = np.where(occupied, 127, np.where(free, -127, 0)).astype(np.int8)
    return OccupancyGrid(log_odds, ros_map.resolution, Point(*ros_map.origin[:2]))


def _read(path: Path) -> RosMap:
    text = text_below(path, ROS_MAP_BYTES_MAX)
    try:
        ros_map = msgspec.convert(parse_yaml(text), RosMap, strict=False)
    except msgspec.ValidationError as error:
        raise BadFile(f"{path}: not a ROS map: {why_invalid(error, wanted=RosMap)}") from None
    except ValueError as error:
        raise BadFile(f"{path}: not YAML: {error}") from None
    if ros_map.origin[2]:
        raise BadFile(f"{path}: origin has a yaw of {ros_map.origin[2]}; only maps with yaw 0 can be imported")
    if ros_map.free_thresh >= ros_map.occupied_thresh:
        raise BadFile(
            f"{path}: free_thresh {ros_map.free_thresh} is not below occupied_thresh {ros_map.occupied_thresh}"
        )
    return ros_map


def _pixels(path: Path) -> NDArray[np.float64]:
    """Return the image's brightness 0..255, row 0 at the map's lowest y. Raises BadFile."""
    from PIL import Image, UnidentifiedImageError

    try:
        if path.exists() and not path.is_file():
            raise BadFile(f"{path}: not a file")
        with warnings.catch_warnings(action="ignore"), Image.open(path, formats=IMAGES) as image:
            if image.width * image.height > CELLS_MAX:
                raise BadFile(f"{path}: {image.width} x {image.height} pixels are more than {CELLS_MAX}")
            if image.mode == "F":
                raise BadFile(f"{path}: its pixels are fractions; map_server takes 8 or 16 bits of grey, or colours")
            if image.mode.startswith("I"):  # 16 bits, which the library would cut off at 255
                return np.clip(np.asarray(image.convert("I"), dtype=np.float64)[::-1] / DEEP, 0, 255)
            return np.asarray(image.convert("L"), dtype=np.float64)[::-1]
    except OSError as error:
        reason = "not an image" if isinstance(error, UnidentifiedImageError) else error.strerror or str(error)
        raise BadFile(f"{path}: {reason}") from None
    except BadFile:
        raise
    except MemoryError:  # by a part of a PNG that says that it has 4 GB
        raise BadFile(f"{path}: it takes more memory than there is") from None
    except (Image.DecompressionBombError, ValueError, SyntaxError) as error:
        raise BadFile(f"{path}: {error}") from None


def _cells(ros_map: RosMap, pixels: NDArray[np.float64]) -> tuple[Cells, Cells]:
    """Return the masks of occupied and of free cells, by map_server's rules."""
    if ros_map.mode == "raw":
        evidence = np.where(pixels <= 100, pixels / 100, 0.5 * (ros_map.free_thresh + ros_map.occupied_thresh))
    else:
        evidence = (pixels if ros_map.negate else 255 - pixels) / 255
    return evidence > ros_map.occupied_thresh, evidence < ros_map.free_thresh


def _solids(ros_map: RosMap, occupied: Cells, path: Path) -> tuple[tuple[Wall, ...], tuple[Box, ...]]:
    """Return the occupied cells as walls, which weaken radio waves, and short ones as boxes. Raises BadFile."""
    rectangles = cover(occupied)
    if len(rectangles) > SOLIDS_MAX:
        raise BadFile(f"{path}: takes {len(rectangles)} boxes, more than {SOLIDS_MAX}; clean the map of speckles")
    walls, things = [], []
    cell, (x0, y0, _) = ros_map.resolution, ros_map.origin
    for row, column, rows, columns in rectangles:
        width, depth = columns * cell, rows * cell
        x, y = x0 + column * cell + width / 2, y0 + row * cell + depth / 2
        if max(width, depth) < WALL_LENGTH:
            things.append(Box(at=(x, y), size=(width, depth, HEIGHT)))
        elif width >= depth:
            walls.append(Wall(start=(x - width / 2, y), end=(x + width / 2, y), thickness=depth))
        else:
            walls.append(Wall(start=(x, y - depth / 2), end=(x, y + depth / 2), thickness=width))
    return tuple(walls), tuple(things)


def _place_for_dock(ros_map: RosMap, free: Cells, path: Path) -> tuple[Spot, float]:
    """Return the place of the dock's front and its direction (degrees).

    It faces the open floor, with as much room as possible, then as near to the map's middle as possible.
    """
    cell = ros_map.resolution
    for room in ROOM:
        found = _most_central(free, 2 * round(room / cell) + 1)
        if found is not None:
            row, column = found
            turns = max(range(4), key=lambda turns: (_open_way(free, row, column, turns, round(room / cell)), -turns))
            dx, dy = ((1, 0), (0, 1), (-1, 0), (0, -1))[turns]
            x = ros_map.origin[0] + (column + 0.5) * cell - dx * DOCK_TO_START
            y = ros_map.origin[1] + (row + 0.5) * cell - dy * DOCK_TO_START
            return (x, y), 90.0 * turns
    raise BadFile(f"{path}: nowhere is there {ROOM[-1]} m of free floor around a robot")


def _most_central(free: Cells, side: int) -> tuple[int, int] | None:
    """Return the middle of the free square of ``side`` cells nearest to the middle of all free cells; None: none."""
    if side > min(free.shape):
        return None
    rows, columns = np.nonzero(free)
    middle_row, middle_column = rows.mean(), columns.mean()
    sums = np.pad(free.astype(np.int32).cumsum(0).cumsum(1), ((1, 0), (1, 0)))
    inside = sums[side:, side:] - sums[:-side, side:] - sums[side:, :-side] + sums[:-side, :-side]
    rows, columns = np.nonzero(inside == side * side)
    if not len(rows):
        return None
    rows, columns = rows + side // 2, columns + side // 2
    best = int(np.argmin((rows - middle_row) ** 2 + (columns - middle_column) ** 2))
    return int(rows[best]), int(columns[best])


def _open_way(free: Cells, row: int, column: int, turns: int, half: int) -> int:
    """Return the number of free cells in a direction (quarter turns from +x) on a lane of 2 ``half`` + 1 cells."""
    if turns % 2:
        free, row, column = free.T, column, row
    lane: Cells = np.logical_and.reduce(free[row - half : row + half + 1], axis=0)
    ahead = lane[column:] if turns < 2 else lane[column::-1]
    return int(np.argmin(ahead)) if not ahead.all() else len(ahead)
