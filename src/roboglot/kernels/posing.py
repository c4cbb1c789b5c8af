"""Moving objects in a picture's scene: people, many small meshes at once, and the soft shadows under them."""

from __future__ import annotations

import math

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, IntArray, SingleArray
from roboglot.kernels.compiled import kernel

SUN = (0.35, 0.55, 0.76)  # direction of the main light
AMBIENT, ABOVE, ASIDE, BEHIND = 0.86, 0.10, 0.20, -0.6  # light on everything, from the ceiling, from the sun; its least
SUN_X, SUN_Y, SUN_Z = (part / math.sqrt(sum(other * other for other in SUN)) for part in SUN)
DEPTH = 0.6  # share of the light that the middle of a shadow takes
SIDES = 8  # of limbs, trunks and heads
AROUND = np.array([(math.cos(math.tau * side / SIDES), math.sin(math.tau * side / SIDES)) for side in range(SIDES + 1)])
CLOSED, CLOSING = 0.08, 0.5  # ends of limbs: radius of the last ring, and how far it is off, by the limb's radius
EYE, EYE_WIDTH, EYE_HEIGHT = 0.016, 0.012, 0.009  # m before the joint; half its size
HIPS, SPINE, LEFT, EARS, EAR, FACE, CROWN, EYES = 0, 1, 2, 3, 4, 5, 6, 7  # points of ``draw_person`` behind the limbs'


@kernel()
def _unit(x: float, y: float, z: float, into: FloatArray) -> None:
    length = max(1e-12, math.sqrt(x * x + y * y + z * z))
    into[0], into[1], into[2] = x / length, y / length, z / length


@kernel()
def _across(a: FloatArray, b: FloatArray, into: FloatArray) -> None:
    """Write the unit vector that is upright on both."""
    _unit(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0], into)


@kernel()
def _ring(middle: FloatArray, along: float, axis: FloatArray, x: float, ahead: FloatArray, y: float, left: FloatArray,
          ring: FloatArray) -> None:  # fmt: skip
    """Write the SIDES + 1 points of an ellipse around ``middle`` + ``along`` axes, with these halves of its axes."""
    for side in range(SIDES + 1):
        for i in range(3):
            round_it = AROUND[side, 0] * x * ahead[i] + AROUND[side, 1] * y * left[i]
            ring[side, i] = middle[i] + along * axis[i] + round_it


@kernel()
def _wrap(rings: FloatArray, count: int, corners: FloatArray, first: int) -> int:
    """Write the quads between ``count`` rings, from number ``first`` on; return the next number."""
    for ring in range(count - 1):
        for side in range(SIDES):
            for i in range(3):
                corners[first, 0, i], corners[first, 1, i] = rings[ring, side, i], rings[ring, side + 1, i]
                corners[first, 2, i], corners[first, 3, i] = rings[ring + 1, side + 1, i], rings[ring + 1, side, i]
            first += 1
    return first


@kernel()
def _limb(start: FloatArray, end: FloatArray, limb: FloatArray, axes: FloatArray, rings: FloatArray) -> None:
    """Write the four rings of a limb with closed ends: its radii, and its length (0: from ``start`` to ``end``)."""
    axis, ahead, left = axes[0], axes[1], axes[2]
    _unit(end[0] - start[0], end[1] - start[1], end[2] - start[2], axis)
    length = limb[2]
    if length == 0.0:
        for i in range(3):
            length += axis[i] * (end[i] - start[i])
    left[0], left[1], left[2] = (1.0, 0.3, 0.1) if abs(axis[0]) < 0.8 else (0.0, 1.0, 0.2)
    _across(axis, left, ahead)
    _across(axis, ahead, left)
    _ring(start, -CLOSING * limb[0], axis, CLOSED * limb[0], ahead, CLOSED * limb[0], left, rings[0])
    _ring(start, 0.0, axis, limb[0], ahead, limb[0], left, rings[1])
    _ring(start, length, axis, limb[1], ahead, limb[1], left, rings[2])
    _ring(start, length + CLOSING * limb[1], axis, CLOSED * limb[1], ahead, CLOSED * limb[1], left, rings[3])


@kernel(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,:,::1], int64[::1],"
    " float64[:,:,::1])"
)
def draw_person(
    joints: FloatArray,
    mixing: FloatArray,
    offsets: FloatArray,
    limbs: FloatArray,
    profiles: FloatArray,
    counts: IntArray,
    corners: FloatArray,
) -> None:
    """Write the quads of a person with these ``joints`` (m): limbs, trunk, head, hair and eyes.

    ``mixing`` @ joints + ``offsets`` are the limbs' starts, then their ends, then the points and axes HIPS to EYES. A
    limb: radii at its ends, and a length, or 0. Each of the three ``profiles`` has so many ``counts`` of rings: their
    share of the axis, half width and half depth.
    """
    points, rings, axes, many = np.empty((len(mixing), 3)), np.empty((8, SIDES + 1, 3)), np.empty((4, 3)), len(limbs)
    for row in range(len(mixing)):
        for i in range(3):
            points[row, i] = offsets[row, i]
            for joint in range(len(joints)):
                points[row, i] += mixing[row, joint] * joints[joint, i]
    quad = 0
    for number in range(many):
        _limb(points[number], points[many + number], limbs[number], axes, rings)
        quad = _wrap(rings, 4, corners, quad)
    others, up, ahead, left = points[2 * many :], axes[3], axes[1], axes[2]
    _across(others[FACE], others[EAR], up)
    for part in range(3):
        foot = others[HIPS] if part == 0 else others[EARS] if part == 1 else others[CROWN]
        axis, beside = (others[SPINE], others[LEFT]) if part == 0 else (up, others[EAR])
        _across(beside, axis, ahead)
        _across(axis, ahead, left)
        for number in range(counts[part]):
            share, width, depth = profiles[part, number]
            _ring(foot, share, axis, depth, ahead, width, left, rings[number])
        quad = _wrap(rings, counts[part], corners, quad)
    _unit(others[FACE, 0], others[FACE, 1], others[FACE, 2], ahead)
    _unit(others[EAR, 0], others[EAR, 1], others[EAR, 2], left)
    for eye in range(2):
        for corner in range(4):
            x, y = EYE_WIDTH * (1.0 if 0 < corner < 3 else -1.0), EYE_HEIGHT * (1.0 if corner > 1 else -1.0)
            for i in range(3):
                corners[quad, corner, i] = others[EYES + eye, i] + EYE * ahead[i] + x * left[i] + y * up[i]
        quad += 1


@kernel()
def _light(quad: FloatArray) -> float:
    """Return how bright a quad is: a lit ceiling everywhere, more from one side, so that edges show."""
    ax, ay, az = quad[1, 0] - quad[0, 0], quad[1, 1] - quad[0, 1], quad[1, 2] - quad[0, 2]
    bx, by, bz = quad[2, 0] - quad[0, 0], quad[2, 1] - quad[0, 1], quad[2, 2] - quad[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    length = max(1e-12, math.sqrt(nx * nx + ny * ny + nz * nz))
    sun = (nx * SUN_X + ny * SUN_Y + nz * SUN_Z) / length
    light: float = AMBIENT + ABOVE * nz / length + ASIDE * max(BEHIND, sun)
    return light


@kernel("void(float64[:,:,::1], float64[:,:,::1], float32[:,::1], int32[::1], float64[:,::1])")
def pose(corners: FloatArray, mappings: FloatArray, paints: SingleArray, owners: Int32Array, poses: FloatArray) -> None:
    """Turn, move and light quads in place, each by its owner's row of ``poses`` (rotation row by row, then position).

    ``corners`` (n, 4, 3), ``mappings`` (n, 3, 3) and ``paints`` (n, 8) as in a Mesh; glowing quads keep their light.
    """
    for quad in range(len(owners)):
        at = poses[owners[quad]]
        for i in range(4):
            x, y, z = corners[quad, i, 0], corners[quad, i, 1], corners[quad, i, 2]
            for axis in range(3):
                corners[quad, i, axis] = at[3 * axis] * x + at[3 * axis + 1] * y + at[3 * axis + 2] * z + at[9 + axis]
        for i in range(3):
            x, y, z = mappings[quad, i, 0], mappings[quad, i, 1], mappings[quad, i, 2]
            for axis in range(3):
                moved = at[3 * axis] * x + at[3 * axis + 1] * y + at[3 * axis + 2] * z
                mappings[quad, i, axis] = moved + at[9 + axis] if i == 0 else moved
        if paints[quad, 7] > 0.0:
            paints[quad, 6] = np.float32(_light(corners[quad]))


@kernel("void(uint8[:,::1], float64[:,::1], float64, float64, float64, float64)")
def darken(shadows: ByteArray, discs: FloatArray, x: float, y: float, cell: float, soft: float) -> None:
    """Take light from cells under each disc (x, y, radius, in m), less and less within ``soft`` m around it.

    ``x``, ``y``: the corner of the cells, m; ``cell``: their size, m.
    """
    height, width = shadows.shape
    for disc in range(len(discs)):
        radius = discs[disc, 2]
        reach = radius + soft
        at_x, at_y = discs[disc, 0] - x, discs[disc, 1] - y
        first_row = min(max(int(np.floor((at_y - reach) / cell)), 0), height)
        last_row = min(max(int(np.floor((at_y + reach) / cell)) + 1, 0), height)
        first_column = min(max(int(np.floor((at_x - reach) / cell)), 0), width)
        last_column = min(max(int(np.floor((at_x + reach) / cell)) + 1, 0), width)
        for row in range(first_row, last_row):
            off_y = (row + 0.5) * cell - at_y
            for column in range(first_column, last_column):
                off_x = (column + 0.5) * cell - at_x
                dark = (reach - math.sqrt(off_x * off_x + off_y * off_y)) / (reach - 0.5 * radius)
                shadows[row, column] = np.uint8(shadows[row, column] * (1.0 - DEPTH * min(max(dark, 0.0), 1.0)))
