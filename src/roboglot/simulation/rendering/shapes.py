"""Coloured quads of simple bodies, for cameras: boxes, turned shapes (cylinders, people's parts), flat cards.

Corners are counter-clockwise seen from outside. Knows no world and no camera.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.posing import pose
from roboglot.values import dataclass

Floats = NDArray[np.float64]
Rgb = tuple[int, int, int]
FLAT = -1
UNTURNED = np.eye(3)
EVERYWHERE = 0  # the room of shapes drawn regardless of the visible rooms


@dataclass(frozen=True, slots=True)
class Paint:
    """Two colours mixed by a texture's mask (FLAT: only the first). ``tile``: m per texture; ``glows``: a lamp."""

    first: Rgb
    second: Rgb = (0, 0, 0)
    texture: int = FLAT
    tile: tuple[float, float] = (1.0, 1.0)
    glows: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """n quads: corners (n, 4, 3), texture origin and axes (n, 3, 3), paints (n, 8), textures (n), rooms (n).

    Equality is identity, for caches.
    """

    corners: Floats
    mappings: Floats
    paints: NDArray[np.float32]
    textures: NDArray[np.int32]
    rooms: NDArray[np.int32]

    def placed(self, x: float, y: float, z: float, yaw: float) -> Mesh:
        """Return the mesh turned by ``yaw`` (rad), then moved (m), and lit again."""
        c, s = math.cos(yaw), math.sin(yaw)
        return self.moved(np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))), (x, y, z))

    def moved(self, rotation: Floats, to: tuple[float, float, float]) -> Mesh:
        """Return the mesh turned by a rotation matrix, then moved (m), and lit again."""
        return posed([(self, rotation, to)])


def joined(meshes: Iterable[Mesh]) -> Mesh:
    """Return one mesh of all."""
    parts = list(meshes) or [mesh_of([], [])]
    return Mesh(*(np.concatenate([getattr(part, name) for part in parts]) for name in Mesh.__dataclass_fields__))


def posed(parts: Sequence[tuple[Mesh, Floats, tuple[float, float, float]]]) -> Mesh:
    """Return one mesh of all, each turned by its matrix, moved, and lit again; mostly without the GIL."""
    whole = joined(mesh for mesh, _, _ in parts)
    counts = [len(mesh.textures) for mesh, _, _ in parts]
    owners = np.repeat(np.arange(len(parts), dtype=np.int32), counts)
    poses = np.array([[*turn.ravel().tolist(), *to] for _, turn, to in parts], dtype=np.float64).reshape(-1, 12)
    pose(whole.corners, whole.mappings, whole.paints, owners, poses)
    return whole


def colour(rgb: Rgb) -> tuple[float, float, float]:
    """Return luma 0..219 and chroma -112..112, BT.601."""
    r, g, b = (channel / 255 for channel in rgb)
    luma = 0.299 * r + 0.587 * g + 0.114 * b
    return 219 * luma, 224 * (b - luma) / 1.772, 224 * (r - luma) / 1.402


def paint_row(paint: Paint, light: float) -> list[float]:
    """Return a paint in the shading kernel's form."""
    first, second = colour(paint.first), colour(paint.second)
    return [*first, *((b - a) / 255 for a, b in zip(first, second, strict=True)), light, 0.0 if paint.glows else 1.0]


def mesh_of(quads: Sequence[Sequence[Sequence[float]]], paints: Sequence[Paint], room: int = EVERYWHERE) -> Mesh:
    """Return a mesh of quads (four corners each) with paints; textures run along the first edge and up the last."""
    corners = np.array(quads, dtype=np.float64).reshape(-1, 4, 3)
    along, up = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    rows = [paint_row(paint, 1.0) for paint in paints]
    tiles = np.array([paint.tile for paint in paints]).reshape(-1, 2)
    mappings = np.empty((len(corners), 3, 3))
    mappings[:, 0] = corners[:, 0]
    mappings[:, 1] = unit(along) / tiles[:, :1]
    mappings[:, 2] = unit(up) / tiles[:, 1:]
    mesh = Mesh(
        corners,
        mappings,
        np.array(rows, dtype=np.float32).reshape(-1, 8),
        np.array([paint.texture for paint in paints], dtype=np.int32),
        np.full(len(corners), room, dtype=np.int32),
    )
    return mesh.moved(UNTURNED, (0.0, 0.0, 0.0))  # lit


def unit(vectors: Floats) -> Floats:
    """Return the vectors along the last axis, scaled to length 1."""
    scaled: Floats = vectors / np.maximum(1e-12, np.sqrt((vectors * vectors).sum(axis=-1, keepdims=True)))
    return scaled


def box(size: Sequence[float], side: Paint, top: Paint, base: float = 0.0, room: int = EVERYWHERE) -> Mesh:
    """Return an upright box around the origin: width along x, depth along y, height."""
    half_x, half_y, low, high = size[0] / 2, size[1] / 2, base, base + size[2]
    feet = [(half_x, -half_y), (half_x, half_y), (-half_x, half_y), (-half_x, -half_y)]
    quads = [
        [(*feet[i], low), (*feet[(i + 1) % 4], low), (*feet[(i + 1) % 4], high), (*feet[i], high)] for i in range(4)
    ]
    quads.append([(x, y, high) for x, y in feet])
    quads.append([(x, y, low) for x, y in reversed(feet)])
    return mesh_of(quads, [side] * 4 + [top] * 2, room)


def turned(
    profile: Sequence[tuple[float, float, Paint]], sides: int, flat: float = 1.0, room: int = EVERYWHERE
) -> Mesh:
    """Return a shape turned around z: (radius, height, paint of the ring above) from the bottom up, closed at the top.

    ``flat`` squeezes it along x.
    """
    angles = [math.tau * i / sides for i in range(sides + 1)]
    around = [(flat * math.cos(angle), math.sin(angle)) for angle in angles]
    quads, paints = [], []
    for (r0, z0, paint), (r1, z1, _) in pairwise(profile):
        for (ax, ay), (bx, by) in pairwise(around):
            quads.append(
                [(r0 * ax, r0 * ay, z0), (r0 * bx, r0 * by, z0), (r1 * bx, r1 * by, z1), (r1 * ax, r1 * ay, z1)]
            )
            paints.append(paint)
    radius, height, paint = profile[-1]
    if radius > 0.001:
        for i in range(1, sides - 1, 2):
            fan = [around[0], around[i], around[i + 1], around[min(i + 2, sides)]]
            quads.append([(radius * x, radius * y, height) for x, y in fan])
            paints.append(paint)
    return mesh_of(quads, paints, room)


def card(at: tuple[float, float, float], yaw: float, size: tuple[float, float], paint: Paint, room: int = 0) -> Mesh:
    """Return an upright rectangle (width, height) around ``at``, facing ``yaw``; textures run to the viewer's right."""
    (x, y, z), (width, height) = at, size
    dx, dy = -math.sin(yaw) * width / 2, math.cos(yaw) * width / 2
    low, high = z - height / 2, z + height / 2
    quad = [(x - dx, y - dy, low), (x + dx, y + dy, low), (x + dx, y + dy, high), (x - dx, y - dy, high)]
    return mesh_of([quad], [paint], room)
