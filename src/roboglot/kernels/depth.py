"""What a grid of depths shows: what stands on the floor, and floor."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import FloatArray
from roboglot.kernels.compiled import kernel

LOW, FLOOR = 0.10, 0.04  # m above the floor: what is lower is stepped over; is floor, for sure
STEEP = 0.7  # rise per way from which a surface is a wall
NEAR = 2.5  # m from base_link within which depth is precise enough


@kernel("Tuple((float64[:,::1], float64[:,::1]))(float64[:,:,::1], float64[:,::1], float64[::1], float64)")
def sort_out(rays: FloatArray, ways: FloatArray, eye: FloatArray, height: float) -> tuple[FloatArray, FloatArray]:
    """What stands, and where there is floor: x and y in base_link (n, 2; m), row by row.

    ``rays`` (rows from above, columns, 3) go out from ``eye`` (3), both in base_link; ``ways`` (rows, columns) is how
    many of its lengths each goes, not finite where nothing was seen. What is above ``height`` (m) is passed below.
    """
    rows, columns = ways.shape
    away, up = np.empty((rows, columns)), np.empty((rows, columns))
    obstacles, floor = np.empty((rows * columns, 2)), np.empty((rows * columns, 2))
    standing = lying = 0
    for row in range(rows):
        for column in range(columns):
            way = ways[row, column] if np.isfinite(ways[row, column]) else np.nan
            x, y = rays[row, column, 0] * way + eye[0], rays[row, column, 1] * way + eye[1]
            up[row, column], away[row, column] = rays[row, column, 2] * way + eye[2], np.sqrt(x * x + y * y)
            if abs(up[row, column]) < FLOOR and away[row, column] < NEAR:
                floor[lying, 0], floor[lying, 1] = x, y
                lying += 1
    for row in range(rows - 1):
        for column in range(columns):
            here, below = up[row, column], up[row + 1, column]  # each against what is seen right below
            farther = max(away[row, column] - away[row + 1, column], 0.0)
            if here - below > STEEP * farther and LOW < here < height and away[row, column] < NEAR:
                obstacles[standing, 0] = rays[row, column, 0] * ways[row, column] + eye[0]
                obstacles[standing, 1] = rays[row, column, 1] * ways[row, column] + eye[1]
                standing += 1
    return obstacles[:standing].copy(), floor[:lying].copy()
