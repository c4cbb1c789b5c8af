"""Rays in three dimensions against spheres, capsules, cylinders and boxes, exactly, as MuJoCo's own ray casting finds
them, in a fraction of its time: solids out of reach are left out once, those behind a hit are not tested.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.kernels.arrays import FloatArray, SingleArray
from roboglot.kernels.compiled import kernel

SPHERE, CAPSULE, CYLINDER, BOX = 2, 3, 5, 6  # as in MuJoCo's mjtGeom
SPARE = 1e-6  # share of a sphere, and m2, by which a ray must clear it for its contents to be skipped


@kernel("float64(float64, float64, float64)")
def _first(a: float, b: float, c: float) -> float:
    """Return the smaller non-negative root of a x^2 + 2 b x + c; inf if there is none."""
    root = b * b - a * c
    if root < 0.0 or a < 1e-15:
        return np.inf
    root = math.sqrt(root)
    near, far = (-b - root) / a, (-b + root) / a
    if near >= 0.0:
        return near
    return far if far >= 0.0 else np.inf


@kernel("float64(float64, float64, float64, float64, float64, float64, float64, float64)")
def _shell(x: float, y: float, z: float, dx: float, dy: float, dz: float, radius: float, half: float) -> float:
    """Return how far a ray goes to the round side of an upright cylinder, within ``half`` of its middle."""
    a, b, c = dx * dx + dy * dy, x * dx + y * dy, x * x + y * y - radius * radius
    root = b * b - a * c
    if root < 0.0 or a < 1e-15:
        return np.inf
    root = math.sqrt(root)
    near, far = (-b - root) / a, (-b + root) / a
    if near >= 0.0 and abs(z + near * dz) <= half:
        return near
    return far if far >= 0.0 and abs(z + far * dz) <= half else np.inf


@kernel("float64(float64, float64, float64, float64, float64, float64, float64, float64)")
def _capsule(x: float, y: float, z: float, dx: float, dy: float, dz: float, radius: float, half: float) -> float:
    """Return how far a ray goes to an upright capsule: its side, or one of the two round ends beyond it."""
    found = _shell(x, y, z, dx, dy, dz, radius, half)
    for end in (-half, half):
        a, b = dx * dx + dy * dy + dz * dz, x * dx + y * dy + (z - end) * dz
        c = x * x + y * y + (z - end) * (z - end) - radius * radius
        root = b * b - a * c
        if root < 0.0:
            continue
        root = math.sqrt(root)
        for along in ((-b - root) / a, (-b + root) / a):
            if 0.0 <= along < found and (z + along * dz - end) * end >= 0.0:
                found = along
    return found


@kernel("float64(float64, float64, float64, float64, float64, float64, float64, float64)")
def _cylinder(x: float, y: float, z: float, dx: float, dy: float, dz: float, radius: float, half: float) -> float:
    """Return how far a ray goes to an upright cylinder: its side, or one of its flat ends."""
    found = _shell(x, y, z, dx, dy, dz, radius, half)
    if abs(dz) < 1e-15:
        return found
    for end in (-half, half):
        along = (end - z) / dz
        across_x, across_y = x + along * dx, y + along * dy
        if 0.0 <= along < found and across_x * across_x + across_y * across_y <= radius * radius:
            found = along
    return found


@kernel("float64(float64, float64, float64, float64, float64, float64, float64, float64, float64)")
def _box(x: float, y: float, z: float, dx: float, dy: float, dz: float, sx: float, sy: float, sz: float) -> float:
    """Return how far a ray goes to a box of these half extents; from within, to where it leaves it."""
    near, far = -np.inf, np.inf
    for at, way, half in ((x, dx, sx), (y, dy, sy), (z, dz, sz)):
        if abs(way) < 1e-15:
            if abs(at) > half:
                return np.inf
            continue
        one, other = (-half - at) / way, (half - at) / way
        near, far = max(near, min(one, other)), min(far, max(one, other))
        if near > far:
            return np.inf
    if near > far or far < 0.0:
        return np.inf
    return near if near >= 0.0 else far


@kernel(
    "float64(int32, float64, float64, float64, float64, float64, float64, float64, float64, float64)",
)
def _along(
    kind: int, x: float, y: float, z: float, dx: float, dy: float, dz: float, sx: float, sy: float, sz: float
) -> float:
    """Return how far a ray from (x, y, z) goes until it meets a solid of this kind, in the solid's own frame."""
    if kind == BOX:
        return _box(x, y, z, dx, dy, dz, sx, sy, sz)
    if kind == CYLINDER:
        return _cylinder(x, y, z, dx, dy, dz, sx, sy)
    if kind == CAPSULE:
        return _capsule(x, y, z, dx, dy, dz, sx, sy)
    return _first(dx * dx + dy * dy + dz * dz, x * dx + y * dy + z * dz, x * x + y * y + z * z - sx * sx)


@kernel("UniTuple(float64, 5)(float64[:,::1])")
def _cone(directions: FloatArray) -> tuple[float, float, float, float, float]:
    """Return a cone around all ``directions``: its axis (x, y, z), cosine and sine of half its angle; sine 2: none."""
    x = y = z = 0.0
    for k in range(len(directions)):
        x, y, z = x + directions[k, 0], y + directions[k, 1], z + directions[k, 2]
    length = math.sqrt(x * x + y * y + z * z)
    if length < 1e-6:
        return 0.0, 0.0, 0.0, 0.0, 2.0
    x, y, z = x / length, y / length, z / length
    cosine = 1.0
    for k in range(len(directions)):
        cosine = min(cosine, x * directions[k, 0] + y * directions[k, 1] + z * directions[k, 2])
    cosine -= SPARE
    return x, y, z, cosine, (math.sqrt(1.0 - cosine * cosine) if cosine > 0.0 else 2.0)


@kernel("float64(float64, float64, float64, float64[::1], float64[::1])")
def _off_box(x: float, y: float, z: float, turn: FloatArray, size: FloatArray) -> float:
    """Return the distance from a place, relative to a box's middle, to the box: walls are much longer than wide."""
    square = 0.0
    for axis in range(3):
        off = abs(turn[axis] * x + turn[3 + axis] * y + turn[6 + axis] * z) - size[axis]
        square += off * off if off > 0.0 else 0.0
    return math.sqrt(square)


@kernel(
    "int64(int32[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1],"
    " float64, int64[::1], float64[::1])"
)
def _reached(
    kinds: NDArray[np.int32],
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    bounds: FloatArray,
    origin: FloatArray,
    directions: FloatArray,
    reach: float,
    chosen: NDArray[np.int64],
    nearest: FloatArray,
) -> int:
    """Return how many solids may be met: ``chosen`` gets their rows, ``nearest`` their least distances (m), sorted."""
    count = 0
    axis_x, axis_y, axis_z, cosine, sine = _cone(directions)
    for i in range(len(kinds)):
        if kinds[i] not in (SPHERE, CAPSULE, CYLINDER, BOX):
            continue
        x, y, z = origin[0] - places[i, 0], origin[1] - places[i, 1], origin[2] - places[i, 2]
        square, bound = x * x + y * y + z * z, reach + bounds[i]
        if square > bound * bound:
            continue
        away = math.sqrt(square)
        if away > bounds[i] and sine < 1.0:
            along = -(x * axis_x + y * axis_y + z * axis_z)
            aside = math.sqrt(max(0.0, square - along * along))
            if aside * cosine - along * sine > bounds[i] * (1.0 + SPARE) + SPARE:
                continue  # the sphere around it lies outside of the cone
        away, place = away - bounds[i], count
        if kinds[i] == BOX:
            away = _off_box(x, y, z, turns[i], sizes[i]) - SPARE
            if away > reach:
                continue
        while place > 0 and nearest[place - 1] > away:  # few are in range
            chosen[place], nearest[place] = chosen[place - 1], nearest[place - 1]
            place -= 1
        chosen[place], nearest[place] = i, away
        count += 1
    return count


@kernel(
    "void(int32[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1],"
    " float64[::1], float64[:,::1], float64, float64[::1])"
)
def _cast_from(
    kinds: NDArray[np.int32],
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    bounds: FloatArray,
    origin: FloatArray,
    directions: FloatArray,
    reach: float,
    found: FloatArray,
) -> None:
    """Fill ``found``: see ``cast``, of one origin."""
    chosen, nearest = np.empty(len(kinds), np.int64), np.empty(len(kinds))
    count = _reached(kinds, places, turns, sizes, bounds, origin, directions, reach, chosen, nearest)
    local, ahead = np.empty((count, 3)), np.empty((count, 4))  # the origin, relative to each solid; bounding sphere
    for place in range(count):
        i = chosen[place]
        x, y, z = origin[0] - places[i, 0], origin[1] - places[i, 1], origin[2] - places[i, 2]
        for axis in range(3):
            local[place, axis] = turns[i, axis] * x + turns[i, 3 + axis] * y + turns[i, 6 + axis] * z
        ahead[place, 0], ahead[place, 1], ahead[place, 2] = -x, -y, -z
        ahead[place, 3] = x * x + y * y + z * z - bounds[i] * bounds[i] * (1.0 + SPARE) - SPARE
    for k in range(len(directions)):
        best, u, v, w = np.inf, directions[k, 0], directions[k, 1], directions[k, 2]
        for place in range(count):
            if nearest[place] > best:
                break
            along = u * ahead[place, 0] + v * ahead[place, 1] + w * ahead[place, 2]
            if ahead[place, 3] > 0.0 and (along < 0.0 or along * along < ahead[place, 3]):
                continue  # misses the sphere
            i = chosen[place]
            dx = turns[i, 0] * u + turns[i, 3] * v + turns[i, 6] * w
            dy = turns[i, 1] * u + turns[i, 4] * v + turns[i, 7] * w
            dz = turns[i, 2] * u + turns[i, 5] * v + turns[i, 8] * w
            x, y, z = local[place, 0], local[place, 1], local[place, 2]
            best = min(best, _along(kinds[i], x, y, z, dx, dy, dz, sizes[i, 0], sizes[i, 1], sizes[i, 2]))
        found[k] = best if best <= reach else np.inf


@kernel(
    "float64[::1](int32[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1],"
    " float64[:,::1], float64[:,::1], float64)"
)
def cast(
    kinds: NDArray[np.int32],
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    bounds: FloatArray,
    origins: FloatArray,
    directions: FloatArray,
    reach: float,
) -> FloatArray:
    """Distances (m) along ``directions`` (k, 3; of length 1); inf where nothing is within ``reach``.

    Each of the ``origins`` (m, 3) is where as many of the directions begin, in their order. Solids by row: kind, middle
    (3), rotation into the world (9, row by row), half extents (3) and the radius of the sphere around it, all as in
    MuJoCo's model. Rays pass through other kinds than the four.
    """
    found, each = np.empty(len(directions)), len(directions) // len(origins)
    for k in range(len(origins)):
        part = slice(k * each, (k + 1) * each)
        _cast_from(kinds, places, turns, sizes, bounds, origins[k], directions[part], reach, found[part])
    return found


@kernel("float64[:,::1](float64[:,::1], float64[:,::1])")
def _turned(vectors: FloatArray, turn: FloatArray) -> FloatArray:
    """Return ``vectors`` (n, 3) turned by a rotation (3, 3)."""
    found = np.empty(vectors.shape)
    for k in range(len(vectors)):
        x, y, z = vectors[k, 0], vectors[k, 1], vectors[k, 2]
        for axis in range(3):
            found[k, axis] = turn[axis, 0] * x + turn[axis, 1] * y + turn[axis, 2] * z
    return found


@kernel(
    "float64[::1](int32[::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[::1],"
    " float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, float64)"
)
def look(
    kinds: NDArray[np.int32],
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    bounds: FloatArray,
    eyes: FloatArray,
    directions: FloatArray,
    turn: FloatArray,
    x: float,
    y: float,
    z: float,
    reach: float,
) -> FloatArray:
    """Return what ``cast`` does, for ``eyes`` and ``directions`` in a frame at (x, y, z), turned by ``turn``."""
    origins = _turned(eyes, turn)
    for k in range(len(origins)):
        origins[k, 0], origins[k, 1], origins[k, 2] = origins[k, 0] + x, origins[k, 1] + y, origins[k, 2] + z
    return cast(kinds, places, turns, sizes, bounds, origins, _turned(directions, turn), reach)


@kernel("float32[::1](float64[::1], float64[::1], float64[::1], UniTuple(float64, 2), UniTuple(float64, 3))")
def reading(
    ways: FloatArray,
    shares: FloatArray,
    noise: FloatArray,
    sigmas: tuple[float, float],
    limits: tuple[float, float, float],
) -> SingleArray:
    """Return a sensor's readings of ``ways`` (m), of each of which it measures its share.

    ``noise`` (standard normal) is scaled by ``sigmas``: m, and m per m2 of the distance. ``limits``: nearest and
    farthest distance, and the reading of what is nearer; farther ones are inf.
    """
    found, (low, high, near) = np.empty(len(ways), np.float32), limits
    for k in range(len(ways)):
        depth = ways[k] * shares[k]
        if depth < np.inf:
            depth += noise[k] * (sigmas[0] + sigmas[1] * (depth * depth))
        found[k] = np.inf if depth > high else near if depth < low else depth
    return found
