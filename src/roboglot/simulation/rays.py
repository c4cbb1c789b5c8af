"""Rays in three dimensions, cast by the physics: what solid thing they meet first. Truth, world frame."""

from __future__ import annotations

from typing import Any

import mujoco
import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.hull import Hull

UNSEEN = 5  # MuJoCo's geom group for what rays pass through
SEEN = np.array([group != UNSEEN for group in range(6)], np.uint8)


class Rays:
    """Casts them against everything but the robot that looks."""

    def __init__(self, model: Any, data: Any) -> None:
        self._model, self._data = model, data

    def cast(
        self, origin: tuple[float, float, float], directions: NDArray[np.float64], reach: float, viewer: Hull
    ) -> NDArray[np.float64]:
        """Distances (m) along ``directions`` (n x 3, of length 1); inf where nothing is nearer than ``reach``."""
        count = len(directions)
        found, distances = np.empty(count, np.int32), np.empty(count)
        groups, own = self._model.geom_group, [*viewer.geoms, *viewer.wheels]
        before = groups[own].copy()
        groups[own] = UNSEEN
        mujoco.mj_multiRay(
            self._model,
            self._data,
            np.array(origin),
            np.ascontiguousarray(directions).ravel(),
            SEEN,
            True,
            -1,
            found,
            distances,
            None,
            count,
            reach,
        )
        groups[own] = before
        distances[found < 0] = np.inf
        return distances
