"""Obstacles of the lidar and the robot's way: memory of them; the way ahead, and how far it is free."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int16Array, Int32Array, SingleArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.occupancy import is_surface

CELL_SQUARE = 0.5001  # squared distance from a cell's centre to its corner, in cells, with a margin
CELL_HALF = 0.7072  # its root
FEW = 800  # cells up to which choosing the rays that come near them is cheaper than tracing all
SECTORS = 128  # of all directions, by which rays are sorted


@kernel("int64(float64, float64, float64, int32[:,::1], int64, float64[:,::1])")
def _noted_near(row: float, col: float, reach: float, noted: Int32Array, count: int, near: FloatArray) -> int:
    """Return how many ``noted`` cells may be met within ``reach`` of (row, col), all in cells.

    ``near`` gets the places of their middles from there.
    """
    found = 0
    for k in range(count):
        up, along = noted[k, 0] + 0.5 - row, noted[k, 1] + 0.5 - col
        if abs(up) <= reach + 1.0 and abs(along) <= reach + 1.0:
            near[found, 0], near[found, 1] = up, along
            found += 1
    return found


@kernel("float64(float64, float64)")
def _bearing(up: float, along: float) -> float:
    """Return a direction as a number from 0 to 4 that grows with the angle, by 1 for each rad at most."""
    share = up / max(abs(up) + abs(along), 1e-12)
    if along < 0.0:
        return 2.0 - share
    return share if share >= 0.0 else 4.0 + share


@kernel("uint8[::1](float64[:,::1], float64, float64, float64[:,::1], int64)")
def _aimed(ends: FloatArray, x: float, y: float, near: FloatArray, count: int) -> ByteArray:
    """Return 1 for each ray from (x, y) that may pass through one of the ``count`` cells with their middles ``near``.

    Rays are sorted by their direction, and only those in the direction of a cell are compared with it.
    """
    rays, aimed = len(ends), np.zeros(len(ends), np.uint8)
    first, after = np.empty(SECTORS, np.int64), np.empty(rays, np.int64)
    for sector in range(SECTORS):
        first[sector] = -1
    for i in range(rays):
        sector = int(_bearing(ends[i, 1] - y, ends[i, 0] - x) * (SECTORS / 4.0)) % SECTORS
        after[i], first[sector] = first[sector], i
    for k in range(count):
        up, along = near[k, 0], near[k, 1]
        away, begin, many = np.sqrt(up * up + along * along), 0, SECTORS
        if away > 1.1:  # the arc sine of up to 0.65 is less than 1.11 times that
            half, middle = 1.11 * CELL_HALF / away, _bearing(up, along)
            begin = int(np.floor((middle - half) * (SECTORS / 4.0)))
            many = min(SECTORS, int(np.floor((middle + half) * (SECTORS / 4.0))) - begin + 1)
        for sector in range(begin, begin + many):
            i = first[sector % SECTORS]
            while i >= 0:
                ray_up, ray_along = ends[i, 1] - y, ends[i, 0] - x
                square, aside = ray_up * ray_up + ray_along * ray_along, ray_along * up - ray_up * along
                if aside * aside <= CELL_SQUARE * square and ray_up * up + ray_along * along >= -np.sqrt(square):
                    aimed[i] = 1
                i = after[i]
    return aimed


@kernel("int64(float32[:,::1], int32[:,::1], int64)")
def still_noted(seen: SingleArray, noted: Int32Array, count: int) -> int:
    """Leave those of the first ``count`` rows of ``noted`` whose cells are not 0; returns how many, or -1 as before."""
    left = min(count, 0)
    for k in range(count):
        if seen[noted[k, 0], noted[k, 1]] > 0.0:
            noted[left, 0], noted[left, 1] = noted[k, 0], noted[k, 1]
            left += 1
    return left


@kernel(
    "Tuple((int64, float64[:,::1]))(int16[:,::1], float32[:,::1], float64[:,::1], uint8[::1], float64[::1], float64,"
    " float64, int32[:,::1], int64)",
)
def _note(
    evidence: Int16Array,
    seen: SingleArray,
    ends: FloatArray,
    hit: ByteArray,
    pose: FloatArray,
    now: float,
    resolution: float,
    noted: Int32Array,
    count: int,
) -> tuple[int, FloatArray]:
    """Do the second half of ``remember``: note the hits."""
    (height, width), met, echoes = seen.shape, 0, np.empty(ends.shape)
    for i in range(ends.shape[0]):
        if hit[i] == 0:
            continue
        echoes[met, 0], echoes[met, 1] = ends[i, 0] + pose[3], ends[i, 1] + pose[4]
        met += 1
        col, row = int(np.floor(ends[i, 0] / resolution)), int(np.floor(ends[i, 1] / resolution))
        if not (0 <= row < height and 0 <= col < width) or is_surface(evidence, row, col):
            continue
        if seen[row, col] == 0.0 and count >= 0:
            if count < noted.shape[0]:
                noted[count, 0], noted[count, 1] = row, col
                count += 1
            else:
                count = -1
        seen[row, col] = now
    return count, echoes[:met].copy()


@kernel("void(float64[:,::1], uint8[::1], float64[::1], float64, float64[:,::1], uint8[::1])")
def _place(rays: FloatArray, hit: ByteArray, pose: FloatArray, reach: float, ends: FloatArray, near: ByteArray) -> None:
    """Fill ``ends`` with the ends of ``rays`` (n, 2; base_link) in the frame of ``pose``, cut at ``reach`` m.

    ``near`` gets 1 for what was ``hit`` within that.
    """
    cos, sin = np.cos(pose[2]), np.sin(pose[2])
    for i in range(rays.shape[0]):
        x, y = rays[i, 0], rays[i, 1]
        away, near[i] = np.sqrt(x * x + y * y), hit[i]
        if away > reach:
            x, y, near[i] = x * (reach / away), y * (reach / away), 0
        ends[i, 0], ends[i, 1] = cos * x - sin * y + pose[0], sin * x + cos * y + pose[1]


@kernel(
    "Tuple((int64, float64[:,::1]))(int16[:,::1], float32[:,::1], float64[:,::1], uint8[::1], float64[::1], float64,"
    " float64, float64, int32[:,::1], int64)",
)
def remember(
    evidence: Int16Array,
    seen: SingleArray,
    rays: FloatArray,
    hit: ByteArray,
    pose: FloatArray,
    reach: float,
    now: float,
    resolution: float,
    noted: Int32Array,
    count: int,
) -> tuple[int, FloatArray]:
    """Note the time ``now`` (> 0) in cells with a hit that the map does not explain; 0 in those that rays pass.

    ``rays`` (n, 2; base_link, m) are looked at up to ``reach`` m; ``pose`` (x, y, yaw) is base_link's, from the grid's
    corner, followed by that (x, y) in map. The first ``count`` rows of ``noted`` are the cells (row, column) that are
    not 0: only rays that come near them are followed. Returns how many there are now, or -1 when they are more than
    ``noted`` holds; and the hits within reach (n, 2; map, m).
    """
    height, width = seen.shape
    x, y = pose[0], pose[1]
    ends, hits = np.empty((rays.shape[0], 2)), np.empty(rays.shape[0], np.uint8)
    _place(rays, hit, pose, reach, ends, hits)
    near, listed = np.empty((max(count, 0), 2)), max(count, 0)
    few = _noted_near(y / resolution, x / resolution, reach / resolution, noted, listed, near)
    picked = count >= 0 and few < FEW
    aimed = _aimed(ends, x, y, near, few) if picked and few else np.empty(0, np.uint8)
    for i in range(ends.shape[0] if few or count < 0 else 0):
        dx, dy = ends[i, 0] - x, ends[i, 1] - y
        if picked and aimed[i] == 0:
            continue
        steps = int(np.sqrt(dx * dx + dy * dy) / resolution)  # without the last cell before the end
        step_x, step_y = dx / (steps + 1.0) / resolution, dy / (steps + 1.0) / resolution  # in cells
        for k in range(steps):
            col = int(np.floor(x / resolution + k * step_x))
            row = int(np.floor(y / resolution + k * step_y))
            if 0 <= row < height and 0 <= col < width:
                seen[row, col] = 0.0
    return _note(evidence, seen, ends, hits, pose, now, resolution, noted, still_noted(seen, noted, count))


@kernel("Tuple((int64, float64))(float64[:,::1], int64, int64, float64, float64)")
def nearest_point(points: FloatArray, first: int, end: int, x: float, y: float) -> tuple[int, float]:
    """Return the number of the nearest of ``points`` (n, 2; m) from ``first`` to ``end``, exclusive; its distance."""
    nearest, best = first, np.inf
    for i in range(first, end):
        dx, dy = points[i, 0] - x, points[i, 1] - y
        away = dx * dx + dy * dy
        if away < best:
            nearest, best = i, away
    return nearest, np.sqrt(best)


@kernel("float64[:,::1](float64[:,::1], int64, int64, float64, float64, float64, float64, int64)")
def way_ahead(
    points: FloatArray, first: int, end: int, x: float, y: float, carrot_x: float, carrot_y: float, count: int
) -> FloatArray:
    """Return a way (n, 2; m): ``count`` steps straight from (x, y) to the carrot, then the ``points`` up to ``end``."""
    way, dx, dy = np.empty((count + 1 + max(0, end - first), 2)), carrot_x - x, carrot_y - y
    for k in range(count + 1):
        share = k / max(1, count)
        way[k, 0], way[k, 1] = x + share * dx, y + share * dy
    for i in range(first, end):
        k = count + 1 + i - first
        way[k, 0], way[k, 1] = points[i, 0], points[i, 1]
    return way


@kernel("float64(float64[:,::1], float64[:,::1], float64, float64, float64)")
def free_way(path: FloatArray, points: FloatArray, x: float, y: float, radius: float) -> float:
    """Return how far a disc of ``radius`` can go along ``path`` (n, 2; m, dense) before it touches ``points``.

    inf: all the way. Points from which it only moves away do not count: a robot close to a wall may leave it.
    """
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for i in range(path.shape[0]):
        low_x, high_x = min(low_x, path[i, 0]), max(high_x, path[i, 0])
        low_y, high_y = min(low_y, path[i, 1]), max(high_y, path[i, 1])
    low_x, low_y, high_x, high_y = low_x - radius, low_y - radius, high_x + radius, high_y + radius
    near, count = np.empty((points.shape[0], 2)), 0
    for k in range(points.shape[0]):
        if low_x <= points[k, 0] <= high_x and low_y <= points[k, 1] <= high_y:
            near[count, 0], near[count, 1] = points[k, 0], points[k, 1]
            count += 1
    gone = 0.0
    for i in range(path.shape[0] if count else 0):
        if i > 0:
            gone += np.sqrt((path[i, 0] - path[i - 1, 0]) ** 2 + (path[i, 1] - path[i - 1, 1]) ** 2)
        for k in range(count):
            away = (path[i, 0] - near[k, 0]) ** 2 + (path[i, 1] - near[k, 1]) ** 2
            if away < radius * radius:
                now = np.sqrt((x - near[k, 0]) ** 2 + (y - near[k, 1]) ** 2)
                if np.sqrt(away) < now - 0.01:
                    return gone
    return np.inf


@kernel("int64(int16[:,::1], float64[:,::1], float64, float64, float64, float64[:,::1])")
def _unexplained(
    evidence: Int16Array, points: FloatArray, x: float, y: float, resolution: float, odd: FloatArray
) -> int:
    """Fill ``odd`` with those points that lie a cell off all the grid has; return how many there are."""
    (height, width), count = evidence.shape, 0
    for i in range(points.shape[0]):
        row, col = int(np.floor((points[i, 1] - y) / resolution)), int(np.floor((points[i, 0] - x) / resolution))
        if 0 <= row < height and 0 <= col < width and not is_surface(evidence, row, col):
            odd[count, 0], odd[count, 1] = points[i, 0], points[i, 1]
            count += 1
    return count


@kernel("float64[:,::1](int16[:,::1], float64[:,::1], float64, float64, float64, float64, float64, int64)")
def things(
    evidence: Int16Array,
    points: FloatArray,
    x: float,
    y: float,
    resolution: float,
    link: float,
    size: float,
    least: int,
) -> FloatArray:
    """Return the means (k, 2; m) of the things that a scan's ``points`` (n, 2; m; in its order) show off the map.

    A thing has ``least`` points or more, each within ``link`` m of the last one, and fits into ``size`` m. The grid has
    its corner at (x, y).
    """
    odd = np.empty((points.shape[0], 2))
    count, found, met = _unexplained(evidence, points, x, y, resolution, odd), np.empty((points.shape[0], 2)), 0
    first = 0  # where a thing begins
    for i in range(count):
        k = i - 1 if i > 0 else count - 1
        if np.hypot(odd[i, 0] - odd[k, 0], odd[i, 1] - odd[k, 1]) > link:
            first = i
            break
    begin = 0
    for i in range(1, count + 1 if count >= least else 0):
        here, last = (first + i) % count, (first + i - 1) % count
        if i < count and np.hypot(odd[here, 0] - odd[last, 0], odd[here, 1] - odd[last, 1]) <= link:
            continue
        low_x = low_y = np.inf
        high_x = high_y = -np.inf
        sum_x = sum_y = 0.0
        for j in range(begin, i):
            at_x, at_y = odd[(first + j) % count, 0], odd[(first + j) % count, 1]
            low_x, high_x, sum_x = min(low_x, at_x), max(high_x, at_x), sum_x + at_x
            low_y, high_y, sum_y = min(low_y, at_y), max(high_y, at_y), sum_y + at_y
        if i - begin >= least and np.hypot(high_x - low_x, high_y - low_y) <= size:
            found[met, 0], found[met, 1] = sum_x / (i - begin), sum_y / (i - begin)
            met += 1
        begin = i
    return found[:met].copy()


@kernel("float64(float64[:,::1], float64, int64)")
def corridor(points: FloatArray, half: float, stretches: int) -> float:
    """Return the widest gap between obstacles to the left and to the right, m; inf: one side is open.

    Of ``points`` (n, 2; base_link, m) those count that lie less than ``half`` m ahead or behind, in so many stretches.
    """
    left, right = np.full(stretches, np.inf), np.full(stretches, np.inf)
    count = 0
    for i in range(points.shape[0]):
        x, y = points[i, 0], points[i, 1]
        if abs(x) >= half:
            continue
        count += 1
        stretch = min(stretches - 1, int((x + half) * (stretches / (2.0 * half))))
        if y > 0.0:
            left[stretch] = min(left[stretch], y)
        else:
            right[stretch] = min(right[stretch], -y)
    if count < 2 * stretches:
        return np.inf
    widest = 0.0
    for stretch in range(stretches):
        widest = max(widest, left[stretch] + right[stretch])
    return widest


@kernel("void(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64[::1], float64[::1])")
def sides(
    way: FloatArray, along: FloatArray, echoes: FloatArray, clearance: float, upper: FloatArray, lower: FloatArray
) -> None:
    """Fill in how far a hull can go to the left (``upper``) and to the right (``lower``) of each point of ``way``.

    m, to the left positive; infinite where no echo is near. ``along`` (n, 2) are unit vectors of the way.
    """
    low_x = low_y = np.inf
    high_x = high_y = -np.inf
    for i in range(way.shape[0]):
        upper[i], lower[i] = np.inf, -np.inf
        low_x, high_x = min(low_x, way[i, 0]), max(high_x, way[i, 0])
        low_y, high_y = min(low_y, way[i, 1]), max(high_y, way[i, 1])
    spare = 3.0 * clearance
    for k in range(echoes.shape[0]):
        echo_x, echo_y = echoes[k, 0], echoes[k, 1]
        if not (low_x - spare < echo_x < high_x + spare and low_y - spare < echo_y < high_y + spare):
            continue
        for i in range(way.shape[0]):
            x, y = echo_x - way[i, 0], echo_y - way[i, 1]
            ahead = abs(x * along[i, 0] + y * along[i, 1])
            left = x * -along[i, 1] + y * along[i, 0]
            if ahead >= clearance or abs(left) >= 2.0 * clearance:
                continue
            reach = np.sqrt(max(0.0, clearance * clearance - ahead * ahead))
            if left > 0.0:
                upper[i] = min(upper[i], left - reach)
            else:
                lower[i] = max(lower[i], left + reach)


@kernel("Tuple((float64[:,::1], float64))(float64[:,::1], float64[:,::1], float64, float64, int64, int64, int64)")
def centring(
    way: FloatArray, echoes: FloatArray, clearance: float, most: float, tangent: int, plateau: int, ramp: int
) -> tuple[FloatArray, float]:
    """Return the offset (n, 2; m) of each point of ``way`` (n, 2; m, dense) to the middle of its gap, and its width.

    A gap has less than ``clearance`` on both sides; the narrowest width is returned, inf without one. Offsets above
    ``most`` are left out. The way's direction is that between the points ``tangent`` before and behind. ``plateau``
    points around a gap move as much as it, and over ``ramp`` points the offset fades.
    """
    count = way.shape[0]
    along, offset = np.empty((count, 2)), np.zeros((count, 2))
    upper, lower, middle, widest = np.empty(count), np.empty(count), np.zeros(count), np.zeros(count)
    for i in range(count):
        before, behind = max(i - tangent, 0), min(i + tangent, count - 1)
        x, y = way[behind, 0] - way[before, 0], way[behind, 1] - way[before, 1]
        length = max(np.hypot(x, y), 1e-9)
        along[i, 0], along[i, 1] = x / length, y / length
    sides(way, along, echoes, clearance, upper, lower)
    width = np.inf
    for i in range(count):
        stands = along[i, 0] == 0.0 and along[i, 1] == 0.0
        if stands or not (np.isfinite(upper[i]) and np.isfinite(lower[i]) and lower[i] > upper[i]):
            continue
        width = min(width, 2.0 * clearance + (upper[i] - lower[i]))
        middle[i] = (upper[i] + lower[i]) / 2.0
        if abs(middle[i]) > most:
            middle[i] = 0.0
    if width == np.inf:
        return offset, width
    for i in range(count):
        for k in range(max(0, i - plateau), min(count, i + plateau + 1)):
            if abs(middle[k]) > abs(widest[i]):
                widest[i] = middle[k]
    for i in range(count):
        shift = 0.0
        for k in range(i - ramp // 2, i - ramp // 2 + ramp):
            shift += widest[min(max(k, 0), count - 1)] * (1.0 / ramp)
        offset[i, 0], offset[i, 1] = shift * -along[i, 1], shift * along[i, 0]
    return offset, width
