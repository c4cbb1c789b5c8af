"""Rays in three dimensions, cast by the physics: what solid thing they meet first. Truth, world frame."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from numpy.typing import NDArray

from roboglot.simulation.bodies.hull import Hull

UNSEEN = 5  # MuJoCo's geom group for what rays pass through
SEEN = np.array([group != UNSEEN for group in range(6)], np.uint8)


class Rays:
    """Casts them against everything but the robot that looks."""

    def __init__(self, model: Any, data: Any) -> None:
        import mujoco  # it takes a quarter of a second to load

        self._model, self._data, self._mujoco = model, data, mujoco

    def cast(
        self, origin: tuple[float, float, float], directions: NDArray[np.float64], reach: float, viewer: Hull
    ) -> NDArray[np.float64]:
        """Distances (m) along ``directions`` (n x 3, of length 1); inf where nothing is nearer than ``reach``."""
        count = len(directions)
        found, distances = np.empty(count, np.int32), np.empty(count)
        with self._looking_through(viewer):
            self._mujoco.mj_multiRay(
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
        distances[found < 0] = np.inf
        return distances

    def meet(self, origin: NDArray[np.float64], way: NDArray[np.float64], viewer: Hull) -> tuple[float, str] | None:
        """What lies first on the straight ``way`` from ``origin`` (3 each, m): at which share of it, and its name."""
        found = np.zeros(1, np.int32)
        with self._looking_through(viewer):
            share = self._mujoco.mj_ray(self._model, self._data, origin, way, SEEN, True, -1, found)
        if not 0.0 <= share <= 1.0:
            return None
        return float(share), self._model.geom(int(found[0])).name or "floor"

    @contextmanager
    def _looking_through(self, viewer: Hull) -> Iterator[None]:
        groups, own = self._model.geom_group, viewer.shape
        before = groups[own].copy()
        groups[own] = UNSEEN
        yield
        groups[own] = before
