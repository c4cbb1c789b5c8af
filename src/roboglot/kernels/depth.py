"""Ground segmentation of depth images: obstacles and floor, and a memory of low obstacles in a grid."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import FloatArray, Int16Array, Int32Array, IntArray, SingleArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.obstacles import still_noted
from roboglot.kernels.occupancy import is_surface

LOW, FLOOR = 0.10, 0.04  # m above the floor: lower objects are stepped over; certainly floor
STEEP = 0.7  # slope from which a surface is a wall
NEAR = 2.5  # m from base_link within which depth is accurate enough


@kernel("Tuple((float64[:,::1], float64[:,::1]))(float64[:,:,::1], float64[:,::1], float64[::1], float64, float64)")
def segment_ground(
    rays: FloatArray, depths: FloatArray, eye: FloatArray, height: float, inner: float
) -> tuple[FloatArray, FloatArray]:
    """Return the points of obstacles (x, y, height) and of the floor (x, y, lowest height seen above it): (n, 3), m.

    All in base_link. ``rays`` (rows from the top, columns, 3) begin at ``eye`` (3); ``depths`` (rows, columns) of the
    pixels, in lengths of their rays, not finite where nothing was seen. Left out are obstacles above ``height`` (m),
    under which the robot fits, and those within ``inner`` (m).
    """
    rows, columns = depths.shape
    away, up = np.empty((rows, columns)), np.empty((rows, columns))
    obstacles, floor = np.empty((rows * columns, 3)), np.empty((rows * columns, 3))
    standing = lying = 0
    for row in range(rows):
        for column in range(columns):
            way = depths[row, column] if np.isfinite(depths[row, column]) else np.nan
            x, y = rays[row, column, 0] * way + eye[0], rays[row, column, 1] * way + eye[1]
            up[row, column], away[row, column] = rays[row, column, 2] * way + eye[2], np.sqrt(x * x + y * y)
            if abs(up[row, column]) < FLOOR and away[row, column] < NEAR:
                floor[lying, 0], floor[lying, 1] = x, y
                across = np.sqrt(rays[0, column, 0] ** 2 + rays[0, column, 1] ** 2)  # of the column's highest ray
                far = np.sqrt((x - eye[0]) ** 2 + (y - eye[1]) ** 2)
                floor[lying, 2] = eye[2] + rays[0, column, 2] * far / across if across > 0.0 else 0.0
                lying += 1
    for row in range(rows - 1):
        for column in range(columns):
            here, below = up[row, column], up[row + 1, column]  # each pixel against the one below it
            farther = max(away[row, column] - away[row + 1, column], 0.0)
            if here - below > STEEP * farther and LOW < here < height and inner < away[row, column] < NEAR:
                obstacles[standing, 0] = rays[row, column, 0] * depths[row, column] + eye[0]
                obstacles[standing, 1] = rays[row, column, 1] * depths[row, column] + eye[1]
                obstacles[standing, 2] = here
                standing += 1
    return obstacles[:standing].copy(), floor[:lying].copy()


@kernel(
    "Tuple((float64[:,::1], float64[:,::1]))(float64[:,:,:,::1], float64[:,:,::1], float64[:,::1], float64, float64)"
)
def segment_ground_all(
    rays: FloatArray, depths: FloatArray, eyes: FloatArray, height: float, inner: float
) -> tuple[FloatArray, FloatArray]:
    """Return obstacles and floor of several sensors of one kind; see ``segment_ground``."""
    obstacles, floor = np.empty((depths.size, 3)), np.empty((depths.size, 3))
    standing = lying = 0
    for k in range(len(depths)):
        some, flat = segment_ground(rays[k], depths[k], eyes[k], height, inner)
        for i in range(len(some)):
            for part in range(3):
                obstacles[standing, part] = some[i, part]
            standing += 1
        for i in range(len(flat)):
            for part in range(3):
                floor[lying, part] = flat[i, part]
            lying += 1
    return obstacles[:standing].copy(), floor[:lying].copy()


@kernel(
    "Tuple((int64, float64[:,::1]))(int16[:,::1], float32[:,::1], float32[:,::1], float64[:,::1], float64[:,::1],"
    " float64[:,::1], float64[::1], float64[::1], float64, float64, float64, int32[:,::1], int64)",
)
def remember_low(
    evidence: Int16Array,
    seen: SingleArray,
    heights: SingleArray,
    floor: FloatArray,
    obstacles: FloatArray,
    echoes: FloatArray,
    pose: FloatArray,
    corner: FloatArray,
    now: float,
    explained: float,
    resolution: float,
    noted: Int32Array,
    listed: int,
) -> tuple[int, FloatArray]:
    """Note the time ``now`` (> 0) in cells with ``obstacles`` that neither map nor ``echoes`` explain, 0 in ``floor``.

    ``floor`` and ``obstacles`` (n, 3) are in base_link at ``pose`` (x, y, yaw), ``echoes`` (n, 2) and ``corner`` (of
    the grid) in map. Beside an occupied cell, within ``explained`` m of an echo and off the grid nothing is new.
    ``heights`` keeps the lowest height seen in each cell: floor below something that hangs higher than the view reaches
    there, as a table top does, does not show that it has gone. The first ``listed`` rows of ``noted`` are the cells
    (row, column) that are not 0. Returns how many there are now, or -1 when they are more than ``noted`` holds; and the
    new obstacles in map (n, 2).
    """
    (height, width), count = seen.shape, 0
    cos, sin, near = np.cos(pose[2]), np.sin(pose[2]), explained * explained
    found = np.empty((len(obstacles), 2))
    for i in range(len(floor)):
        x = cos * floor[i, 0] - sin * floor[i, 1] + pose[0] - corner[0]
        y = sin * floor[i, 0] + cos * floor[i, 1] + pose[1] - corner[1]
        row, col = int(np.floor(y / resolution)), int(np.floor(x / resolution))
        if 0 <= row < height and 0 <= col < width and heights[row, col] <= floor[i, 2]:
            seen[row, col] = 0.0
    listed = still_noted(seen, noted, listed)
    for i in range(len(obstacles)):
        x = cos * obstacles[i, 0] - sin * obstacles[i, 1] + pose[0]
        y = sin * obstacles[i, 0] + cos * obstacles[i, 1] + pose[1]
        row, col = int(np.floor((y - corner[1]) / resolution)), int(np.floor((x - corner[0]) / resolution))
        if not (1 <= row < height - 1 and 1 <= col < width - 1) or is_surface(evidence, row, col):
            continue
        is_new = True
        for k in range(len(echoes)):
            if (x - echoes[k, 0]) ** 2 + (y - echoes[k, 1]) ** 2 <= near:
                is_new = False
                break
        if not is_new:
            continue
        found[count, 0], found[count, 1] = x, y
        count += 1
        if seen[row, col] == 0.0 and listed >= 0:
            if listed < len(noted):
                noted[listed, 0], noted[listed, 1] = row, col
                listed += 1
            else:
                listed = -1
        up = np.float32(obstacles[i, 2])
        heights[row, col] = min(heights[row, col], up) if seen[row, col] == np.float32(now) else up
        seen[row, col] = now
    return listed, found[:count].copy()


@kernel(
    "float64[:,::1](float32[:,::1], int32[:,::1], int64, int64[::1], float32, float64, float64, float64)",
)
def seen_since(
    seen: SingleArray, noted: Int32Array, listed: int, window: IntArray, since: float, x: float, y: float, side: float
) -> FloatArray:
    """Return the centres (n, 2; m) of cells in a window of rows and columns that were ``seen`` at ``since`` or later.

    ``window``: first row, end of rows, first column, end. ``noted`` and ``listed`` as for ``remember_low``; (x, y) is
    the corner of the grid, ``side`` that of a cell.
    """
    count, few = 0, max(listed, 0)
    for row in range(window[0], window[1] if listed < 0 else window[0]):
        for col in range(window[2], window[3]):
            count += seen[row, col] >= since
    found, at = np.empty((count + few, 2)), 0
    for k in range(few):
        row, col = noted[k, 0], noted[k, 1]
        if window[0] <= row < window[1] and window[2] <= col < window[3] and seen[row, col] >= since:
            found[at, 0], found[at, 1] = x + (col + 0.5) * side, y + (row + 0.5) * side
            at += 1
    for row in range(window[0], window[1] if count else window[0]):
        for col in range(window[2], window[3]):
            if seen[row, col] >= since:
                found[at, 0], found[at, 1] = x + (col + 0.5) * side, y + (row + 0.5) * side
                at += 1
    return found[:at].copy()
