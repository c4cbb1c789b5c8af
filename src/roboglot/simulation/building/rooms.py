"""Rooms of a floor, from its walls with all doors closed, to spread a crowd. Knows no robot."""

from __future__ import annotations

import math
from collections.abc import Iterator

from roboglot.simulation.building.blueprint import Rectangle, holes_of, shaft_of
from roboglot.simulation.world.description import Floor, Lift, Spot
from roboglot.values import dataclass

CELL = 0.25  # m
CELLS_MAX = 200  # along one side; larger floors get larger cells
LEAST = 4.0  # m² of a room
Cell = tuple[int, int]  # column and row


@dataclass(frozen=True, slots=True)
class Rooms:
    """Cells of each room; ``doors``: middles of all openings between them (world, m)."""

    cell: float
    corner: Spot
    rooms: tuple[frozenset[Cell], ...]
    doors: tuple[Spot, ...]

    def cell_at(self, x: float, y: float) -> Cell:
        """Return the cell of a place."""
        return math.floor((x - self.corner[0]) / self.cell), math.floor((y - self.corner[1]) / self.cell)

    def area(self, room: int) -> float:
        """Return the area of a room, m²."""
        return len(self.rooms[room]) * self.cell**2

    def spots(self, room: int, step: float) -> Iterator[Spot]:
        """Yield places in a room, in rows ``step`` m apart, from its middle outwards."""
        cells = self.rooms[room]
        columns, rows = zip(*cells, strict=True)
        (left, right), (low, high) = ((min(of), max(of) + 1) for of in (columns, rows))
        x, y = ((a + b) / 2 * self.cell + c for a, b, c in zip((left, low), (right, high), self.corner, strict=True))
        reach = math.ceil(max(right - left, high - low) * self.cell / 2 / step)
        steps = range(-reach, reach + 1)
        for i, j in sorted(((i, j) for i in steps for j in steps), key=lambda at: (math.hypot(*at), at)):
            if self.cell_at(x + i * step, y + j * step) in cells:
                yield x + i * step, y + j * step


def rooms_of(floor: Floor, lift: Lift | None) -> Rooms:
    """Return the rooms of a floor; places without a wall between them are in one room."""
    cell = max(CELL, max(floor.size) / CELLS_MAX)
    blank = Rooms(cell, floor.origin, (), tuple(_doors(floor)))
    width, depth = (math.ceil(size / cell) for size in floor.size)
    free = {(column, row) for column in range(width) for row in range(depth)} - set(_closed(floor, lift, blank))
    rooms = []
    while free:
        room, edge = set[Cell](), [free.pop()]
        while edge:
            column, row = at = edge.pop()
            room.add(at)
            beside = {(column + 1, row), (column - 1, row), (column, row + 1), (column, row - 1)} & free
            free -= beside
            edge.extend(beside)
        if len(room) * cell**2 >= LEAST:
            rooms.append(frozenset(room))
    return Rooms(cell, floor.origin, tuple(sorted(rooms, key=min)), blank.doors)


def _closed(floor: Floor, lift: Lift | None, grid: Rooms) -> Iterator[Cell]:
    """Yield the cells of walls, including doors, and those without a level floor."""
    for wall in floor.walls:
        (x0, y0), (x1, y1) = wall.start, wall.end
        steps = max(1, math.ceil(2.0 * wall.length / grid.cell))
        before = None
        for n in range(steps + 1):
            column, row = at = grid.cell_at(x0 + (x1 - x0) * n / steps, y0 + (y1 - y0) * n / steps)
            yield at
            if before and before[0] != column and before[1] != row:
                yield before[0], row  # no gap between cells that meet at a corner
            before = at
    gaps = holes_of(floor) + ([shaft_of(lift)] if lift else [])
    for uneven in floor.relief:
        length = uneven.profile[-1][0]
        reach = math.hypot(length, uneven.width / 2)
        gaps.append(Rectangle(uneven.at[0] - reach, uneven.at[1] - reach, 2 * reach, 2 * reach))
    for gap in gaps:
        (left, low), (right, high) = grid.cell_at(gap.x, gap.y), grid.cell_at(gap.x + gap.width, gap.y + gap.depth)
        yield from ((column, row) for column in range(left, right + 1) for row in range(low, high + 1))


def _doors(floor: Floor) -> Iterator[Spot]:
    for wall in floor.walls:
        for door in wall.doors:
            share = door.at / max(wall.length, 1e-9)
            (x0, y0), (x1, y1) = wall.start, wall.end
            yield x0 + (x1 - x0) * share, y0 + (y1 - y0) * share
