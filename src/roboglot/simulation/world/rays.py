"""Rays in three dimensions to the first solid. Truth, world frame."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels import loading
from roboglot.simulation.bodies.hull import Hull, rotation

if TYPE_CHECKING:
    from mujoco import MjData, MjModel

PASSED = 0  # a kind of shape that the kernel skips
Floats = NDArray[np.float64]
UNSEEN = 5  # MuJoCo's group for geoms that rays pass through
SEEN = np.array([group != UNSEEN for group in range(6)], np.uint8)
COMPILED = (2, 3, 5, 6)  # MuJoCo's numbers of the shapes that the kernel supports: all but ramps, which are meshes


class Rays:
    """Casts rays against everything but the observing robot."""

    def __init__(self, model: MjModel, data: MjData) -> None:
        import mujoco  # loading takes a quarter of a second

        self._model, self._data, self._mujoco = model, data, mujoco
        self._kinds: dict[Hull, NDArray[np.int32]] = {}  # of all shapes except those of the observing robot
        self._kernel: Callable[..., Floats] | None = None
        self._look: Callable[..., Floats] | None = None
        self.reading: Callable[..., NDArray[np.float32]] = _reading
        self._outdated = False  # whether people and props may have moved since the physics placed all shapes

    def outdate(self) -> None:
        """Mark the shapes' places as outdated: the physics sleeps while people walk on."""
        self._outdated = True

    def _place_shapes(self) -> None:
        if self._outdated:
            self._outdated = False
            self._mujoco.mj_kinematics(self._model, self._data)

    def load_kernel(self) -> None:
        """Use the compiled kernel from now on, if it supports all shapes of the world.

        Its distances equal MuJoCo's up to rounding.
        """
        if np.isin(self._model.geom_type, COMPILED).all():
            with loading():
                from roboglot.kernels.rays import cast, look, reading

            self._kernel, self._look, self.reading = cast, look, reading

    def cast(self, origins: Floats, directions: Floats, reach: float, viewer: Hull) -> Floats:
        """Return distances (m) along ``directions`` (n x 3, of length 1); inf where nothing is nearer than ``reach``.

        The directions are split evenly among the ``origins`` (m x 3), in order.
        """
        self._place_shapes()
        if self._kernel is None:
            bundles = np.split(directions, len(origins))
            parts = zip(origins, bundles, strict=True)
            return np.concatenate([self._cast_slowly(origin, ways, reach, viewer) for origin, ways in parts])
        return self._kernel(*self._solids(viewer), origins, directions, reach)

    def look(self, eyes: Floats, directions: Floats, reach: float, viewer: Hull) -> Floats:
        """Return the same for ``eyes`` and ``directions`` in the viewer's base_link."""
        turn, (x, y, z) = rotation(viewer.tilt, viewer.turned), (viewer.x, viewer.y, viewer.elevation)
        if self._look is None:
            return self.cast(eyes @ turn.T + (x, y, z), directions @ turn.T, reach, viewer)
        self._place_shapes()
        return self._look(*self._solids(viewer), eyes, directions, turn, x, y, z, reach)

    def _solids(self, viewer: Hull) -> tuple[NDArray[np.generic], ...]:
        """Return kinds, places, rotations, sizes and bounds of all shapes, as the kernel takes them."""
        kinds = self._kinds.get(viewer)
        if kinds is None:
            kinds = self._kinds[viewer] = self._model.geom_type.copy()
            kinds[viewer.shape] = PASSED
        model, data = self._model, self._data
        return kinds, data.geom_xpos, data.geom_xmat, model.geom_size, model.geom_rbound

    def _cast_slowly(self, origin: Floats, directions: Floats, reach: float, viewer: Hull) -> Floats:
        """Return the same from MuJoCo, which supports every shape."""
        count = len(directions)
        found, distances = np.empty(count, np.int32), np.empty(count)
        ways = np.ascontiguousarray(directions).ravel()
        with self._looking_through(viewer):
            self._mujoco.mj_multiRay(
                self._model, self._data, origin, ways, SEEN, True, -1, found, distances, None, count, reach
            )
        distances[(found < 0) | (distances > reach)] = np.inf
        return distances

    def meet(self, origin: Floats, way: Floats, viewer: Hull) -> tuple[float, str] | None:
        """Return the first hit on the straight ``way`` from ``origin`` (3 each, m): share of the way, and name."""
        self._place_shapes()
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


def _reading(
    ways: Floats,
    shares: Floats,
    noise: Floats,
    sigmas: tuple[float, float],
    limits: tuple[float, float, float],
) -> NDArray[np.float32]:
    """Return the same as the kernel of this name, with numpy."""
    depths, (low, high, near) = ways * shares, limits
    depths += noise * (sigmas[0] + sigmas[1] * np.where(ways < np.inf, depths, 0.0) ** 2)
    return np.where(depths > high, np.inf, np.where(depths < low, near, depths)).astype(np.float32)
