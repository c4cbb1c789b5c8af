"""Moving objects in a picture's scene: many small meshes at once, and the soft shadows under them."""

from __future__ import annotations

import math

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, SingleArray
from roboglot.kernels.compiled import kernel

SUN = (0.35, 0.55, 0.76)  # direction of the main light
AMBIENT, ABOVE, ASIDE, BEHIND = 0.86, 0.10, 0.20, -0.6  # light on everything, from the ceiling, from the sun; its least
SUN_X, SUN_Y, SUN_Z = (part / math.sqrt(sum(other * other for other in SUN)) for part in SUN)
DEPTH = 0.6  # share of the light that the middle of a shadow takes


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
