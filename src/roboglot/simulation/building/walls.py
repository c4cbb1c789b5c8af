"""Distances to walls and furniture. World frame."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from roboglot.kernels import loading
from roboglot.kernels.arrays import FloatArray
from roboglot.simulation.building.blueprint import SolidKind, solids_of
from roboglot.simulation.building.keeping import WORLDS_MAX, kept
from roboglot.simulation.world.description import WorldDescription


class Walls:
    """Distances to walls and furniture, without movable things."""

    def __init__(self, world: WorldDescription) -> None:
        self._floors, self._table = _rows_of(world)
        self._room: Callable[[FloatArray, float, float, int], float] | None = None

    @property
    def table(self) -> FloatArray:
        """Rows x, y, cosine and sine of yaw, half the width and the depth, floor."""
        return self._table

    def load_kernel(self) -> None:
        """Use the compiled kernel from now on, which gives the same numbers."""
        with loading():
            from roboglot.kernels.free_motion import room

        self._room = room

    def room(self, x: float, y: float, floor: int) -> float:
        """Return the distance to the nearest wall or piece of furniture, m; inf: there is none."""
        if self._room is not None:
            return self._room(self._table, x, y, floor)
        at_x, at_y, c, s, width, depth = self._floors[floor]
        dx, dy = x - at_x, y - at_y
        along = np.maximum(0.0, np.abs(c * dx + s * dy) - width / 2)
        aside = np.maximum(0.0, np.abs(c * dy - s * dx) - depth / 2)
        return float(np.sqrt(np.min(along * along + aside * aside, initial=np.inf)))


@kept(WORLDS_MAX)
def _rows_of(world: WorldDescription) -> tuple[list[FloatArray], FloatArray]:
    """Return each floor's solids, in columns, and the table of all."""
    floors = []
    for floor in world.floors:
        solids = [s for s in solids_of(floor, world.lift, lift_here=True) if s.kind is not SolidKind.DOCK]
        rows = [(s.pose.x, s.pose.y, math.cos(s.pose.yaw), math.sin(s.pose.yaw), *s.size[:2]) for s in solids]
        floors.append(np.array(rows).reshape(-1, 6).T.copy())
    numbered = [np.vstack((those, np.full(those.shape[1], floor))) for floor, those in enumerate(floors)]
    table = np.ascontiguousarray(np.hstack(numbered).T)
    table[:, 4:6] /= 2.0
    return floors, table
