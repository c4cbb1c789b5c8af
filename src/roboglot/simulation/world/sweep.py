"""Casts the rays of a whole turn at once against edges and circles in the plane, exactly. Plain numpy, no state.

Each edge or circle is met by a run of neighbouring rays; only those pairs are computed. Agrees with MuJoCo's rays to
rounding, takes a third of their time in the office and a tenth in an imported map, and needs no compiler. ``blur``
turns exact distances into a lidar's readings.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

Edges = NDArray[np.complex128]  # n x 2: both ends as x + iy; the solid is on the left
Circles = NDArray[np.complex128]  # n x 2: centre as x + iy, and radius
Distances = NDArray[np.float64]
NOTHING = np.empty((0, 2), dtype=np.complex128)


@lru_cache(maxsize=8)
def directions(rays: int) -> NDArray[np.complex128]:
    """Return the unit vectors of a turn from -pi, as x + iy."""
    ways: NDArray[np.complex128] = np.exp(1j * (-math.pi + math.tau / rays * np.arange(rays)))
    return ways


def sweep(edges: Edges, circles: Circles, x: float, y: float, yaw: float, rays: int, reach: float) -> Distances:
    """Return distances (m) of ``rays`` from (x, y); ray i points to yaw - pi + i * tau / rays. inf beyond ``reach``.

    Only the outsides of solids are visible: a solid around (x, y) is transparent.
    """
    ranges, origin = np.full(rays, np.inf), complex(x, y)
    turn = complex(math.cos(yaw), -math.sin(yaw))
    ways = directions(rays)
    _meet_edges((edges - origin) * turn, ways, ranges)
    if len(circles):
        _meet_circles((circles[:, 0] - origin) * turn, circles[:, 1].real, ways, reach, ranges)
    ranges[ranges > reach] = np.inf
    return ranges


def blur(exact: Distances, noise: NDArray[np.float32], sigma: float, low: float, high: float) -> NDArray[np.float32]:
    """Return distances with ``noise`` (standard normal) of ``sigma`` m; NaN below ``low``, inf beyond ``high`` (m)."""
    ranges = noise * np.float32(sigma)
    np.add(ranges, exact, out=ranges, casting="same_kind")
    near, far = ranges < np.float32(low), ranges > np.float32(high)
    ranges[near], ranges[far] = np.nan, np.inf
    return ranges


def _meet_edges(edges: Edges, directions: NDArray[np.complex128], ranges: NDArray[np.float64]) -> None:
    start, end = edges[:, 0], edges[:, 1]
    swept = start * end.conj()  # its angle is the turn from end to start, its imaginary part twice an area
    seen = swept.imag > 1e-9  # m2; an edge seen end-on would be hit by rounding only, even at the eye
    start, end, swept = start[seen], end[seen], swept[seen]
    which, ray = _pairs(np.angle(end), np.angle(swept), len(ranges))
    along = (end - start)[which]
    u = directions[ray]
    with np.errstate(divide="ignore"):  # a ray along an edge merely touches it
        distance = swept.imag[which] / (along.real * u.imag - along.imag * u.real)
    np.minimum.at(ranges, ray, np.abs(distance))


def _meet_circles(
    middles: NDArray[np.complex128],
    radii: NDArray[np.float64],
    directions: NDArray[np.complex128],
    reach: float,
    ranges: NDArray[np.float64],
) -> None:
    away = np.abs(middles)
    near = (away > radii) & (away - radii < reach)
    middles, radii, away = middles[near], radii[near], away[near]
    half = np.arcsin(radii / away)
    which, ray = _pairs(np.angle(middles) - half, 2.0 * half, len(ranges))
    seen = middles[which] * directions[ray].conj()  # real: way to the point nearest the centre; imaginary: the miss
    depth = np.sqrt(np.maximum(0.0, radii[which] ** 2 - seen.imag**2))
    np.minimum.at(ranges, ray, seen.real - depth)


def _pairs(
    first: NDArray[np.float64], span: NDArray[np.float64], rays: int
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return pairs of shapes and rays that meet, for shapes covering the angles ``first`` to ``first + span``, rad."""
    step = math.tau / rays
    begin = np.ceil((first + math.pi) / step).astype(np.intp)
    count = np.floor((first + span + math.pi) / step).astype(np.intp) + 1 - begin
    which = np.repeat(np.arange(len(first)), count)
    ray = np.arange(len(which)) + np.repeat(begin - np.cumsum(count) + count, count)
    return which, ray % rays
