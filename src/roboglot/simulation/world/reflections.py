"""Reflections of lidar rays: most pass glass, mirrors deflect them.

Glass reflects rays that meet it nearly at a right angle, and lets all others pass; a mirror deflects each ray, so that
its target seems to stand behind the mirror. Plane geometry on rows of numbers, as in ``sight``; no state.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

Rows = NDArray[np.float64]  # n x 4: x, y, x, y of edges counter-clockwise around solids; x, y, radius, 0 of circles
Vectors = NDArray[np.float64]  # n x 2

SQUARE = math.cos(math.radians(12.0))  # cosine of the angle up to which glass reflects a ray
OFF = 1e-9  # m, m2


def _cross(a: Vectors, b: Vectors) -> NDArray[np.float64]:
    product: NDArray[np.float64] = a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
    return product


def met(edges: Rows, origins: Vectors, ways: Vectors) -> tuple[NDArray[np.float64], Vectors]:
    """Return each ray's distance (m) to the first edge met from outside (inf: none), and its outward normal."""
    if not len(edges):
        return np.full(len(ways), np.inf), np.zeros_like(ways)
    start, along = edges[:, :2], edges[:, 2:] - edges[:, :2]
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1)
    normals /= np.maximum(np.hypot(*normals.T), OFF)[:, None]
    to_start = start[None] - origins[:, None]
    denominator = _cross(ways[:, None], along[None])
    outside = ways @ normals.T < -OFF
    with np.errstate(divide="ignore", invalid="ignore"):
        away = _cross(to_start, along[None]) / denominator
        part = _cross(to_start, ways[:, None]) / denominator
    away[~(outside & (away > OFF) & (part >= 0.0) & (part <= 1.0))] = np.inf
    nearest = away.argmin(axis=1)
    return away[np.arange(len(ways)), nearest], normals[nearest]


def met_circles(circles: Rows, origins: Vectors, ways: Vectors) -> NDArray[np.float64]:
    """Return each ray's distance (m) to the first circle met from outside; inf: none."""
    if not len(circles):
        return np.full(len(ways), np.inf)
    off = circles[None, :, :2] - origins[:, None]
    along = (off * ways[:, None]).sum(axis=2)
    beside = _cross(ways[:, None], off)
    inside = circles[None, :, 2] ** 2 - beside**2
    away = along - np.sqrt(np.maximum(inside, 0.0))
    away[(inside <= 0.0) | (away <= OFF)] = np.inf
    nearest: NDArray[np.float64] = away.min(axis=1)
    return nearest


def seen(
    behind: NDArray[np.float64], glass: Rows, mirrors: Rows, edges: Rows, circles: Rows, eye: Vectors, ways: Vectors
) -> NDArray[np.float64]:
    """Return the distances (m) of a turn from ``eye`` (1, 2) along ``ways`` (unit vectors, world).

    ``behind``: distances without glass and mirrors; ``edges`` and ``circles``: the solids of that world.
    """
    found, eyes = behind.copy(), np.repeat(eye, len(ways), axis=0)
    away, normals = met(glass, eyes, ways)
    square = (away < found) & (-(ways * normals).sum(axis=1) > SQUARE)
    found[square] = away[square]
    away, normals = met(mirrors, eyes, ways)
    turned = np.flatnonzero(away < found)
    if not len(turned):
        return found
    way, normal = ways[turned], normals[turned]
    sent = way - 2.0 * (way * normal).sum(axis=1)[:, None] * normal
    places = eyes[turned] + away[turned, None] * way
    on = np.minimum(met(edges, places, sent)[0], met_circles(circles, places, sent))
    found[turned] = away[turned] + on
    return found
