"""A floor's plan in cells, for cameras: rooms, walls that block the view, shadows beside things."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.posing import darken
from roboglot.kernels.raster import ROOMS_MAX, label, look
from roboglot.model.geometry import Pose
from roboglot.simulation.building.blueprint import Solid, SolidKind
from roboglot.simulation.world.description import Floor, Wall
from roboglot.values import dataclass

CELL = 0.1  # m
CELLS_MAX = 1000  # along one side; larger floors get larger cells
SOFTNESS = 3  # cells over which a shadow extends
DARK = 0.5
Cells = NDArray[np.uint8]


@dataclass(frozen=True, slots=True)
class Plan:
    """``rooms``: a number per cell (0 outside); ``solid``: walls, doors left out; ``shadows``: 0 dark, 255 bright."""

    x: float
    y: float
    cell: float
    rooms: Cells
    solid: Cells
    shadows: Cells

    def room_at(self, x: float, y: float) -> int:
        """Return the room number of a place (world, m); 0: outside."""
        column, row = math.floor((x - self.x) / self.cell), math.floor((y - self.y) / self.cell)
        if not (0 <= row < self.rooms.shape[0] and 0 <= column < self.rooms.shape[1]):
            return 0
        return int(self.rooms[row, column])

    def seen_from(self, x: float, y: float, yaw: float, spread: float) -> Cells:
        """Return for each room number whether a part of the room is visible (1 or 0)."""
        visible = np.zeros(ROOMS_MAX + 1, dtype=np.uint8)
        visible[0] = 1
        look(self.solid, self.rooms, (x - self.x) / self.cell, (y - self.y) / self.cell, yaw, spread, visible)
        return visible

    def shadows_with(self, discs: Iterable[tuple[float, float, float]]) -> Cells:
        """Return ``shadows`` with soft ones under ``discs`` (x, y, radius; m)."""
        shadows = self.shadows.copy()
        under = np.array(list(discs), dtype=np.float64).reshape(-1, 3)
        darken(shadows, under, self.x, self.y, self.cell, SOFTNESS * self.cell)
        return shadows

    def _window(self, x0: float, y0: float, x1: float, y1: float) -> tuple[slice, slice]:
        height, width = self.rooms.shape

        def bounded(value: float, most: int) -> int:
            return min(max(math.floor(value / self.cell), 0), most)

        return (
            slice(bounded(y0 - self.y, height), bounded(y1 - self.y + self.cell, height)),
            slice(bounded(x0 - self.x, width), bounded(x1 - self.x + self.cell, width)),
        )


def plan_of(floor: Floor, solids: Iterable[Solid]) -> Plan:
    """Return the plan of a floor with these solids."""
    cell = max(CELL, max(floor.size) / CELLS_MAX)
    shape = tuple(max(2, math.ceil(size / cell)) for size in reversed(floor.size))
    blank = Plan(*floor.origin, cell, *(np.zeros(shape, dtype=np.uint8) for _ in range(3)))
    closed = np.zeros(shape, dtype=np.uint8)
    dark = np.zeros(shape)
    for solid in solids:
        if solid.kind is SolidKind.WALL:
            _stamp(blank, solid, blank.solid)
        if solid.kind in (SolidKind.WALL, SolidKind.LANDING_DOOR):
            _stamp(blank, solid, closed)
        if solid.base < 0.3:
            _stamp(blank, solid, dark)
    for wall in floor.walls:
        _stamp(blank, whole(wall, floor.height), closed)
    label(closed, blank.rooms)
    for axis in (0, 1):
        dark = _blurred(_blurred(dark, axis), axis)
    blank.shadows[:] = np.clip(255 * (1.0 - DARK * dark), 0, 255)
    return blank


def whole(wall: Wall, height: float) -> Solid:
    """Return the wall without its doors."""
    (x0, y0), (x1, y1) = wall.start, wall.end
    pose = Pose((x0 + x1) / 2, (y0 + y1) / 2, math.atan2(y1 - y0, x1 - x0))
    return Solid(SolidKind.WALL, pose, (wall.length, wall.thickness, height))


def _stamp(plan: Plan, solid: Solid, cells: NDArray[np.uint8] | NDArray[np.float64]) -> None:
    """Mark the cells in the solid's footprint, which is widened to at least a cell."""
    half_x, half_y = (max(size, plan.cell * 1.01) / 2 for size in solid.size[:2])
    reach = math.hypot(half_x, half_y)
    x, y = solid.pose.x, solid.pose.y
    rows, columns = plan._window(x - reach, y - reach, x + reach, y + reach)
    if rows.stop <= rows.start or columns.stop <= columns.start:
        return
    off_y = plan.y + (np.arange(rows.start, rows.stop) + 0.5)[:, None] * plan.cell - y
    off_x = plan.x + (np.arange(columns.start, columns.stop) + 0.5) * plan.cell - x
    c, s = math.cos(solid.pose.yaw), math.sin(solid.pose.yaw)
    if solid.round:
        inside = np.hypot(off_x, off_y) <= half_x
    else:
        inside = (np.abs(c * off_x + s * off_y) <= half_x) & (np.abs(c * off_y - s * off_x) <= half_y)
    cells[rows, columns][inside] = 1


def _blurred(values: NDArray[np.float64], axis: int) -> NDArray[np.float64]:
    """Return the mean over SOFTNESS cells to both sides."""
    widths = [(0, 0), (0, 0)]
    widths[axis] = (SOFTNESS + 1, SOFTNESS)
    sums = np.pad(values, widths, mode="edge").cumsum(axis)
    span, size = 2 * SOFTNESS + 1, values.shape[axis]
    mean: NDArray[np.float64] = (sums.take(range(span, span + size), axis) - sums.take(range(size), axis)) / span
    return mean
