"""Scan matching by Gauss-Newton: laser points against the surfaces of an occupancy grid, around an odometry prior.

Each point is moved onto a line fitted to the mean hits of the cells around it (moving least squares), so the result is
finer than the cells. Surfaces seen from their other side are ignored: thin walls have two faces. The match takes the
directions of surfaces for exact; along a bare corridor, what they seem to show is their noise alone. What it really
shows, and what it makes of an error, is returned beside its covariance.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import FloatArray, Int16Array, Int32Array, IntArray, SingleArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.linear import invert
from roboglot.kernels.occupancy import is_surface

SPREAD = 0.15  # m, within which the cells around a point count
SIGMA = 0.02  # m, of a point against a surface
SIGMA_LOOSE = 0.06  # m, where the surface has no distinct direction
ROBUST, ROBUST_START = 0.06, 0.24  # m, beyond which a point loses its influence: at the end, at the start
INLIER = 0.08  # m
CELLS = 25  # around a point, including its own
MOVED = 0.0002  # m of motion after which a point's surface is looked up again: no more than the match's tolerance
CORRELATION = 0.1  # share of the points' information that is used, since they are not independent
THIN, THIN_WEIGHT = 0.04**2, 10.0  # m2, of a surface that shows where along a wall it is: a pole; its weight, at least
VAGUE = 0.6  # share of other surfaces' information, without direction, that may be about their place along a wall
FEIGNED = 1.5  # times the information that wrong directions feign: as much is none


@kernel("int64(int32[:,::1], float32[:,::1], int16[:,::1], int64, int64, float64, float64[:,:,::1], int64)")
def _surfaces(
    slots: Int32Array,
    surfaces: SingleArray,
    evidence: Int16Array,
    row: int,
    col: int,
    resolution: float,
    around: FloatArray,
    i: int,
) -> int:
    """Fill ``around[i]`` with the surfaces in the cells around (row, col); returns how many there are.

    Of each: mean x and y of its hits, the summed unit vector towards the sensors, the number of hits.
    """
    count, place = 0, around[np.uintp(i)]
    for r in range(max(0, row - 2), min(evidence.shape[0], row + 3)):
        for c in range(max(0, col - 2), min(evidence.shape[1], col + 3)):
            slot = slots[np.uintp(r), np.uintp(c)]
            if not 0 < slot < surfaces.shape[0]:  # another thread may have added one
                continue
            cell = surfaces[np.uintp(slot)]
            hits = cell[0]
            if hits <= 0.0 or not (evidence[np.uintp(r), np.uintp(c)] > 0 or is_surface(evidence, r, c)):
                continue
            one, found = 1.0 / hits, place[np.uintp(count)]
            found[0], found[1] = cell[1] * one + c * resolution, cell[2] * one + r * resolution
            found[2], found[3], found[4] = cell[3], cell[4], hits
            count += 1
    return count


@kernel("UniTuple(float64, 6)(float64[:,:,::1], int64, int64, float64, float64, float64, float64)")
def _line(
    around: FloatArray, i: int, count: int, x: float, y: float, beam_x: float, beam_y: float
) -> tuple[float, float, float, float, float, float]:
    """Return the surface around (x, y) as ``surface_near`` has it, from the ``count`` rows of ``around[i]``.

    The last value is the variance of its direction (rad2), or, of an unclear one, its extent (m2).
    """
    total = mean_x = mean_y = xx = xy = yy = 0.0
    place = around[np.uintp(i)]
    for k in range(count):
        cell = place[np.uintp(k)]
        hits = cell[4]
        if cell[2] * beam_x + cell[3] * beam_y > 0.2 * hits:
            continue
        # Relative to (x, y), for precision.
        dx, dy = cell[0] - x, cell[1] - y
        near = 1.0 - (dx * dx + dy * dy) / (SPREAD * SPREAD)
        if near <= 0.0:
            continue
        weight = min(hits, 10.0) * near * near
        total += weight
        mean_x += weight * dx
        mean_y += weight * dy
        xx += weight * dx * dx
        xy += weight * dx * dy
        yy += weight * dy * dy
    if total < 1e-3:
        return 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    share = 1.0 / total
    mean_x, mean_y = mean_x * share, mean_y * share
    xx, xy, yy = xx * share - mean_x * mean_x, xy * share - mean_x * mean_y, yy * share - mean_y * mean_y
    half, root = (xx + yy) / 2.0, np.sqrt(((xx - yy) / 2.0) ** 2 + xy * xy)
    long, short = half + root, half - root
    if long < 0.015 * 0.015 or short > 0.25 * long:
        return x + mean_x, y + mean_y, 0.0, 0.0, total, long
    cosine = (xx - yy) / (2.0 * root)  # of twice the angle of the surface
    along, aside = np.sqrt(max(0.0, (1.0 + cosine) / 2.0)), np.sqrt(max(0.0, (1.0 - cosine) / 2.0))
    vague = max(0.0, short) / long * share  # of a line through as many points
    return x + mean_x, y + mean_y, (aside if xy < 0.0 else -aside), along, total, vague


@kernel("UniTuple(float64, 5)(int32[:,::1], float32[:,::1], int16[:,::1], float64, float64, float64, float64, float64)")
def surface_near(
    slots: Int32Array,
    surfaces: SingleArray,
    evidence: Int16Array,
    x: float,
    y: float,
    beam_x: float,
    beam_y: float,
    resolution: float,
) -> tuple[float, float, float, float, float]:
    """Return the surface around (x, y) as seen along the beam: mean x and y, normal x and y (0, 0: unclear), weight."""
    around = np.empty((1, CELLS, 5))
    row, col = int(np.floor(y / resolution)), int(np.floor(x / resolution))
    count = _surfaces(slots, surfaces, evidence, row, col, resolution, around, 0)
    mean_x, mean_y, nx, ny, weight, _ = _line(around, 0, count, x, y, beam_x, beam_y)
    return mean_x, mean_y, nx, ny, weight


@kernel()
def _add(system: FloatArray, nx: float, ny: float, turn: float, residual: float, weight: float) -> None:
    """Add one linear equation to the upper triangle (6) and right side (3) of the normal equations."""
    system[0] += weight * nx * nx
    system[1] += weight * nx * ny
    system[2] += weight * nx * turn
    system[3] += weight * ny * ny
    system[4] += weight * ny * turn
    system[5] += weight * turn * turn
    system[6] -= weight * nx * residual
    system[7] -= weight * ny * residual
    system[8] -= weight * turn * residual


@kernel()
def _linearise(
    slots: Int32Array,
    surfaces: SingleArray,
    evidence: Int16Array,
    points: FloatArray,
    pose: FloatArray,
    sensor: FloatArray,
    resolution: float,
    reach: float,
    lines: FloatArray,
    places: IntArray,
    around: FloatArray,
    system: FloatArray,
) -> tuple[int, int]:
    """Fill the normal equations at ``pose``; returns how many points fit a surface, how many lie in known cells.

    ``reach`` (m): beyond it a point loses its influence. ``lines`` (n, 8): where each point was when its surface was
    looked up, and what was found; it is looked up again when the point has moved. ``places`` (n, 3): the cell then, and
    how many surfaces ``around`` (n, CELLS, 5) it there are.
    """
    height, width = evidence.shape
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    sensor_x = pose[0] + cos * sensor[0] - sin * sensor[1]
    sensor_y = pose[1] + sin * sensor[0] + cos * sensor[1]
    for i in range(9):
        system[i] = 0.0
    fit = known = 0
    for i in range(points.shape[0]):
        off_x = cos * points[i, 0] - sin * points[i, 1]
        off_y = sin * points[i, 0] + cos * points[i, 1]
        x, y = pose[0] + off_x, pose[1] + off_y
        row, col = int(np.floor(y / resolution)), int(np.floor(x / resolution))
        if row < 0 or col < 0 or row >= height or col >= width:
            continue
        if not abs(x - lines[i, 0]) + abs(y - lines[i, 1]) < MOVED:
            beam_x, beam_y = x - sensor_x, y - sensor_y
            away = np.sqrt(beam_x * beam_x + beam_y * beam_y) + 1e-9
            if places[i, 0] != row or places[i, 1] != col:
                places[i, 0], places[i, 1] = row, col
                places[i, 2] = _surfaces(slots, surfaces, evidence, row, col, resolution, around, i)
            found = _line(around, i, places[i, 2], x, y, beam_x / away, beam_y / away)
            lines[i, 0], lines[i, 1] = x, y
            lines[i, 2], lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6], lines[i, 7] = found
        mean_x, mean_y, nx, ny, weight = lines[i, 2], lines[i, 3], lines[i, 4], lines[i, 5], lines[i, 6]
        if weight == 0.0:
            if evidence[row, col] != 0:
                known += 1
            continue
        known += 1
        if nx == 0.0 and ny == 0.0:
            dx, dy = x - mean_x, y - mean_y
            gap = dx * dx + dy * dy
            robust = CORRELATION / (SIGMA_LOOSE * SIGMA_LOOSE) / (1.0 + gap / (reach * reach)) ** 2
            _add(system, 1.0, 0.0, -off_y, dx, robust)
            _add(system, 0.0, 1.0, off_x, dy, robust)
        else:
            residual = nx * (x - mean_x) + ny * (y - mean_y)
            gap = residual * residual
            robust = CORRELATION / (SIGMA * SIGMA) / (1.0 + gap / (reach * reach)) ** 2
            _add(system, nx, ny, ny * off_x - nx * off_y, residual, robust)
        if gap < INLIER * INLIER:
            fit += 1
    return fit, known


@kernel(
    "float64[:,::1](int32[:,::1], float32[:,::1], int16[:,::1], float64[:,::1], float64, float64, float64,"
    " float64[::1], float64)"
)
def gaps(
    slots: Int32Array,
    surfaces: SingleArray,
    evidence: Int16Array,
    points: FloatArray,
    x: float,
    y: float,
    yaw: float,
    sensor: FloatArray,
    resolution: float,
) -> FloatArray:
    """Return how far (m) each point lies off its surface, base_link at the pose, and the surface's weight (n, 2).

    inf and 0: no surface is near. The weight grows with the number of the surface's hits.
    """
    found, around = np.empty((points.shape[0], 2)), np.empty((1, CELLS, 5))
    cos, sin = np.cos(yaw), np.sin(yaw)
    for i in range(points.shape[0]):
        beam_x = cos * (points[i, 0] - sensor[0]) - sin * (points[i, 1] - sensor[1])
        beam_y = sin * (points[i, 0] - sensor[0]) + cos * (points[i, 1] - sensor[1])
        away = np.sqrt(beam_x * beam_x + beam_y * beam_y) + 1e-9
        px, py = x + cos * points[i, 0] - sin * points[i, 1], y + sin * points[i, 0] + cos * points[i, 1]
        row, col = int(np.floor(py / resolution)), int(np.floor(px / resolution))
        count = _surfaces(slots, surfaces, evidence, row, col, resolution, around, 0)
        mean_x, mean_y, nx, ny, weight, _ = _line(around, 0, count, px, py, beam_x / away, beam_y / away)
        found[i, 1] = weight
        if weight == 0.0:
            found[i, 0] = np.inf
        elif nx == 0.0 and ny == 0.0:
            found[i, 0] = np.sqrt((px - mean_x) ** 2 + (py - mean_y) ** 2)
        else:
            found[i, 0] = abs(nx * (px - mean_x) + ny * (py - mean_y))
    return found


@kernel()
def _feigned(points: FloatArray, pose: FloatArray, lines: FloatArray) -> tuple[float, float, float, float]:
    """Return the information about x and y (xx, xy, yy) that wrong directions of the ``lines`` found at ``pose`` feign.

    The last value is the information of thin things, which show their place whatever the direction.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    xx = xy = yy = things = 0.0
    for i in range(points.shape[0]):
        x, y = pose[0] + cos * points[i, 0] - sin * points[i, 1], pose[1] + sin * points[i, 0] + cos * points[i, 1]
        nx, ny, weight, vague = lines[i, 4], lines[i, 5], lines[i, 6], lines[i, 7]
        dx, dy = x - lines[i, 2], y - lines[i, 3]
        if weight == 0.0 or lines[i, 0] == np.inf:
            continue
        if nx == 0.0 and ny == 0.0:
            robust = CORRELATION / (SIGMA_LOOSE * SIGMA_LOOSE) / (1.0 + (dx * dx + dy * dy) / (ROBUST * ROBUST)) ** 2
            if vague < THIN and weight >= THIN_WEIGHT:
                things += robust
            else:
                xx, yy = xx + VAGUE * robust, yy + VAGUE * robust
        else:
            gap = (nx * dx + ny * dy) ** 2
            robust = vague * CORRELATION / (SIGMA * SIGMA) / (1.0 + gap / (ROBUST * ROBUST)) ** 2
            xx, xy, yy = xx + robust * ny * ny, xy - robust * nx * ny, yy + robust * nx * nx
    return xx, xy, yy, things


@kernel()
def _discount(system: FloatArray, feigned: tuple[float, float, float, float], true: FloatArray) -> None:
    """``true`` (3, 3) = the normal equations' matrix without what wrong directions feign about the position.

    Only in the worst direction, whatever the yaw: in the others it is little. ``feigned``: as ``_feigned`` has it.
    """
    index = 0
    for i in range(3):
        for j in range(i, 3):
            true[i, j] = true[j, i] = system[index]
            index += 1
    turn = system[5]
    if turn <= 0.0:
        return
    lever_x, lever_y = system[2] / turn, system[4] / turn
    aa, ab, bb = system[0] - system[2] * lever_x, system[1] - system[2] * lever_y, system[3] - system[4] * lever_y
    half, root = (aa + bb) / 2.0, np.sqrt(((aa - bb) / 2.0) ** 2 + ab * ab)
    if root <= 0.0:
        return
    cosine = (aa - bb) / (2.0 * root)  # of twice the angle of the best direction
    along, aside = np.sqrt(max(0.0, (1.0 + cosine) / 2.0)), np.sqrt(max(0.0, (1.0 - cosine) / 2.0))
    vx, vy = (aside if ab < 0.0 else -aside), along
    xx, xy, yy, things = feigned
    less = min(max(0.0, half - root - things), FEIGNED * (xx * vx * vx + 2.0 * xy * vx * vy + yy * vy * vy))
    true[0, 0] -= less * vx * vx
    true[0, 1] -= less * vx * vy
    true[1, 0] = true[0, 1]
    true[1, 1] -= less * vy * vy


@kernel()
def _considered(
    points: FloatArray, pose: FloatArray, lines: FloatArray, system: FloatArray, normal: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how much of an error before a match stays (3, 3), and the covariance (3, 3) of what the match adds to it.

    ``lines``: the surfaces of the ``points`` at ``pose``; ``system``: the normal equations' upper triangle; ``normal``:
    the covariance that the match claims. It makes an error e to e - normal (true e + noise): ``true`` information only
    pulls it back, while the noise is that of all points.
    """
    true, stays, noise, added = np.empty((3, 3)), np.eye(3), np.empty((3, 3)), np.zeros((3, 3))
    _discount(system, _feigned(points, pose, lines), true)
    index = 0
    for i in range(3):
        for j in range(i, 3):
            noise[i, j] = noise[j, i] = system[index]
            index += 1
    for i in range(3):
        for j in range(3):
            for k in range(3):
                stays[i, j] -= normal[i, k] * true[k, j]
                for m in range(3):
                    added[i, j] += normal[i, k] * noise[k, m] * normal[j, m]
    return stays, added


@kernel("void(float64[:,::1], float64[::1], float64[:,::1])")
def _covariance(information: FloatArray, system: FloatArray, result: FloatArray) -> None:
    """``result`` = inverse of a symmetric 3x3 matrix plus the normal equations' upper triangle."""
    index = 0
    for i in range(3):
        for j in range(i, 3):
            result[i, j] = information[i, j] + system[index]
            result[j, i] = result[i, j]
            index += 1
    invert(result)


@kernel(
    "Tuple((float64[::1], float64[:,::1], float64, int64, int64, float64[:,::1], float64[:,::1]))"
    "(int32[:,::1], float32[:,::1], int16[:,::1], float64[:,::1], float64[::1], float64[::1], float64[:,::1],"
    " float64[::1], float64, int64)",
)
def match(
    slots: Int32Array,
    surfaces: SingleArray,
    evidence: Int16Array,
    points: FloatArray,
    start: FloatArray,
    prior: FloatArray,
    covariance: FloatArray,
    sensor: FloatArray,
    resolution: float,
    iterations: int,
) -> tuple[FloatArray, FloatArray, float, int, int, FloatArray, FloatArray]:
    """Return the pose (x, y from the grid's corner, yaw) at which ``points`` (n, 2; base_link, m) fit the grid best.

    Begins at ``start``; ``covariance`` (3, 3) is the prior's; ``sensor`` the lidar's x, y in base_link. Returns the
    pose, its covariance, the squared distance from the prior in the prior's standard deviations, the points that fit,
    those where something is known, and two matrices as ``_considered`` has them.
    """
    pose, step, right, system = np.empty(3), np.empty(3), np.empty(3), np.empty(9)
    information, normal, lines = np.empty((3, 3)), np.empty((3, 3)), np.empty((points.shape[0], 8))
    places, around = np.empty((points.shape[0], 3), np.int64), np.empty((points.shape[0], CELLS, 5))
    for i in range(points.shape[0]):
        lines[i, 0], places[i, 0] = np.inf, -1
    for i in range(3):
        pose[i] = start[i]
        for j in range(3):
            information[i, j] = covariance[i, j]
    invert(information)
    reach = ROBUST_START if iterations > 0 else ROBUST
    fit, known = _linearise(
        slots, surfaces, evidence, points, pose, sensor, resolution, reach, lines, places, around, system
    )
    for _ in range(iterations):
        _covariance(information, system, normal)
        for i in range(3):
            right[i] = system[6 + i]
            for j in range(3):
                right[i] -= information[i, j] * (pose[j] - prior[j])
        for i in range(3):
            step[i] = normal[i, 0] * right[0] + normal[i, 1] * right[1] + normal[i, 2] * right[2]
        for i in range(3):
            pose[i] += step[i]
        settled = reach <= ROBUST
        reach = max(ROBUST, reach * 0.5)
        fit, known = _linearise(
            slots, surfaces, evidence, points, pose, sensor, resolution, reach, lines, places, around, system
        )
        if settled and abs(step[0]) + abs(step[1]) < 2e-4 and abs(step[2]) < 1e-4:
            break
    strain = 0.0
    for i in range(3):
        for j in range(3):
            strain += (pose[i] - prior[i]) * information[i, j] * (pose[j] - prior[j])
    _covariance(information, system, normal)
    stays, added = _considered(points, pose, lines, system, normal)
    return pose, normal, strain, fit, known, stays, added
