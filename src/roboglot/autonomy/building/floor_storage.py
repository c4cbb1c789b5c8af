"""Storage of one floor's state: kept on disk while the robot is on another one."""

from __future__ import annotations

import contextlib
import logging
import zlib

import msgspec
import numpy as np

from roboglot.autonomy.slam.evidence import CELLS_MAX, EvidenceGrid, is_too_large
from roboglot.autonomy.slam.grid_import import evidence_of
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.system.file_store import FileStore
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.values import dataclass

log = logging.getLogger(__name__)


@dataclass(slots=True)
class Storey:
    """State of one floor; poses are in its map (m, rad)."""

    map: EvidenceGrid
    home: Pose | None
    drawn: Annotations
    waiting: Pose
    inside: Pose


class _File(msgspec.Struct):
    """Floor as stored on disk; ``cells`` are int8, row by row, compressed."""

    width: int
    height: int
    resolution: float
    origin: Point
    cells: bytes
    home: Pose | None
    drawn: Annotations
    waiting: Pose
    inside: Pose


class FloorStorage:
    """Storage of floors by number; in memory only for a robot without a FileStore."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._storeys: dict[int, Storey] = {}

    async def put(self, floor: int, storey: Storey, *, lasting: bool) -> None:
        """Store a floor; ``lasting``: on disk too, with a warning if that fails."""
        self._storeys[floor] = storey
        if lasting and FileStore in self._robot:
            try:
                await self._robot[FileStore].write(_name(floor), _packed(storey))
            except RobotError as error:
                log.warning("the map of floor %d of robot %s is kept in memory only: %s", floor, self._robot.id, error)

    async def take(self, floor: int) -> Storey | None:
        """Remove a floor's state from memory and return it, or read it from disk; None: never stored or unreadable."""
        storey = self._storeys.pop(floor, None)
        if storey is None and FileStore in self._robot:
            with contextlib.suppress(NotFound):
                data = await self._robot[FileStore].read(_name(floor))
                try:
                    storey = _unpacked(data)
                except (msgspec.MsgspecError, zlib.error, ValueError, RobotError) as error:
                    log.warning("cannot read the map of floor %d of robot %s: %s", floor, self._robot.id, error)
        return storey


def _name(floor: int) -> str:
    return f"floors/{floor}.msgpack"


def _packed(storey: Storey) -> bytes:
    grid = storey.map.occupancy()
    cells = zlib.compress(np.ascontiguousarray(grid.log_odds).tobytes())
    places = storey.home, storey.drawn, storey.waiting, storey.inside
    return msgspec.msgpack.encode(_File(grid.width, grid.height, grid.resolution, grid.origin, cells, *places))


def _unpacked(data: bytes) -> Storey:
    file = msgspec.msgpack.decode(data, type=_File)
    if min(file.width, file.height) < 0 or is_too_large(file.height, file.width):
        raise ValueError(f"{file.width} x {file.height} cells")
    raw = zlib.decompressobj().decompress(file.cells, CELLS_MAX)
    cells = np.frombuffer(raw, np.int8).reshape(file.height, file.width)
    grid = evidence_of(OccupancyGrid(cells, file.resolution, file.origin))
    return Storey(grid, file.home, file.drawn, file.waiting, file.inside)
