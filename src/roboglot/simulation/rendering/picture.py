"""Draws scenes into pictures with the raster kernels. Plain arrays in and out; no clock, no component."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.lanes import MARGIN
from roboglot.kernels.layouts import COEFFICIENTS, FIRST
from roboglot.kernels.raster import CORNERS_MAX, project
from roboglot.kernels.raster_shading import BAND, LINE, SAMPLES, shade
from roboglot.simulation.rendering.interior import GROUND_TILE
from roboglot.simulation.rendering.views import Eye, Scene

POLYGONS_MAX = 12_000  # per picture
LOWEST = 0.05  # m that the eye keeps from floor and ceiling


class Renderer:
    """Buffers for pictures of one size; one picture at a time. The last one is kept, with the key of its view."""

    def __init__(self, width: int, height: int, fov: float) -> None:
        self._width, self._height = width, height
        self._last: tuple[object, NDArray[np.uint8]] | None = None
        self._lens = np.array((width / 2 / math.tan(fov / 2), width / 2, height / 2))
        self._planes = np.empty((FIRST + POLYGONS_MAX, COEFFICIENTS))
        self._sources = np.empty(FIRST + POLYGONS_MAX, dtype=np.int32)
        self._outlines = np.empty((FIRST + POLYGONS_MAX, CORNERS_MAX, 2))
        self._spans = np.empty((FIRST + POLYGONS_MAX, 3), dtype=np.int32)
        self._band = (
            np.empty((BAND, 2)),
            np.empty((BAND, width + MARGIN), dtype=np.float32),
            np.empty((BAND, width + MARGIN), dtype=np.uint16),
            np.zeros(SAMPLES, dtype=np.int32),
            np.zeros((3, width + LINE), dtype=np.uint8),
        )

    def develop(self, key: object, scene: Callable[[], Scene], eye: Eye, gain: float) -> NDArray[np.uint8]:
        """Return the last picture if its view had the same ``key``, else draw the ``scene``; read only."""
        if self._last is None or self._last[0] != key:
            planes = self.render(scene(), eye, gain)
            planes.setflags(write=False)
            self._last = key, planes
        return self._last[1]

    def render(self, scene: Scene, eye: Eye, gain: float) -> NDArray[np.uint8]:
        """Return the picture as YUV 4:2:0 planes, one below the other (3/2 height, width)."""
        ground, plan = scene.ground, scene.plan
        rotation = np.ascontiguousarray(eye.rotation)
        visible = plan.seen_from(eye.x, eye.y, eye.yaw, eye.spread)
        at = np.array((eye.x, eye.y, eye.z))
        drawn, paints = FIRST, len(ground.paints)
        for mesh in scene.meshes:
            more = project(
                mesh.corners, mesh.mappings, mesh.rooms, visible, rotation, at, self._lens, self._planes,
                self._sources, self._outlines, self._spans, drawn,
            )  # fmt: skip
            self._sources[drawn : drawn + more] += paints
            drawn, paints = drawn + more, paints + len(mesh.paints)
        self._lay_ground(scene, eye, rotation)
        width, height = self._width, self._height
        picture = np.empty((height * 3 // 2, width), dtype=np.uint8)
        chroma = picture[height:].reshape(2, height // 2, width // 2)
        frame = np.array((plan.x / GROUND_TILE, plan.y / GROUND_TILE, GROUND_TILE / plan.cell))
        shade(
            self._outlines, self._spans, drawn, self._planes, self._sources,
            np.concatenate((ground.paints, *(mesh.paints for mesh in scene.meshes))),
            np.concatenate((ground.textures, *(mesh.textures for mesh in scene.meshes))),
            scene.masks, plan.rooms, scene.shadows, frame, gain, *self._band, picture[:height], chroma[0], chroma[1],
        )  # fmt: skip
        return picture

    def _lay_ground(self, scene: Scene, eye: Eye, rotation: NDArray[np.float64]) -> None:
        """Set the planes of floor and ceiling."""
        focal, cx, cy = self._lens.tolist()
        ground = scene.ground
        below, above = max(LOWEST, eye.z - ground.floor), max(LOWEST, ground.ceiling - eye.z)
        rays = np.array((rotation[0] / focal, rotation[1] / focal, rotation[2])).T  # world axis x (per x, per y, fixed)
        rays[:, 2] -= rays[:, 0] * cx + rays[:, 1] * cy
        for number, scale in ((0, -1.0 / below), (1, 1.0 / above)):
            plane = self._planes[number]
            plane[0:3] = rays[2] * scale
            plane[3:6], plane[6] = rays[0] / GROUND_TILE, eye.x / GROUND_TILE
            plane[7:10], plane[10] = rays[1] / GROUND_TILE, eye.y / GROUND_TILE
        self._sources[0], self._sources[1] = 0, len(ground.paints) - 1
