"""An occupancy grid from laser scans: evidence per cell, and where within the cell the surface lies.

Arrays: ``evidence`` int16 (rows along y, columns along x; 0 unknown, below free, above occupied); ``surfaces`` float32
(n, 5), of each cell that was ever hit: number of hits, their summed x and y (m, from the cell's corner) and the summed
unit vector from the hits towards the sensor; ``slots`` int32 (rows, columns): the cell's row of these, 0: it has none;
``marks`` int16: the number (modulo SCANS, from 1) of the last scan that touched the cell, or FROZEN: none may.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import BoolArray, ByteArray, FloatArray, Int16Array, Int32Array, SingleArray
from roboglot.kernels.compiled import kernel

HIT = 100
MISS = -50
EVIDENCE_MAX = 1000
EVIDENCE_MIN = -1000
HITS_MAX = 5000.0
FROZEN, SCANS = -1, 32767
NEIGHBOURS = 0.06  # rad between rays that count as neighbours
BETWEEN_MAX = 6
GRAZING = 0.35  # sine of the angle below which a ray passes along a surface


@kernel("boolean(int16[:,::1], int64, int64)")
def is_surface(evidence: Int16Array, row: int, col: int) -> bool:
    """Return True if hits in this cell belong to a surface: it is occupied, or beside an occupied one.

    Echoes scatter to both sides of a wall. Those on the near side lie in cells that rays have cleared; without them
    every wall would stand farther away, by more the noisier the lidar is and the longer it looked.
    """
    for r in range(max(0, row - 1), min(evidence.shape[0], row + 2)):
        for c in range(max(0, col - 1), min(evidence.shape[1], col + 2)):
            if evidence[np.uintp(r), np.uintp(c)] > 0:
                return True
    return False


@kernel("boolean(int16[:,::1], int32[:,::1], float32[:,::1], int64, int64, float64, float64, float64)")
def _is_grazed(
    evidence: Int16Array,
    slots: Int32Array,
    surfaces: SingleArray,
    row: int,
    col: int,
    dx: float,
    dy: float,
    resolution: float,
) -> bool:
    """Return True if a ray along (dx, dy) grazes the surface in an occupied cell, which then carries no evidence."""
    count = mean_x = mean_y = xx = xy = yy = 0.0
    for r in range(max(0, row - 2), min(evidence.shape[0], row + 3)):
        for c in range(max(0, col - 2), min(evidence.shape[1], col + 3)):
            slot = slots[r, c]
            if evidence[r, c] <= 0 or slot == 0:
                continue
            hits = surfaces[slot, 0]
            if hits <= 0.0:
                continue
            x, y = surfaces[slot, 1] / hits + (c - col) * resolution, surfaces[slot, 2] / hits + (r - row) * resolution
            count += 1.0
            mean_x += x
            mean_y += y
            xx += x * x
            xy += x * y
            yy += y * y
    if count < 4.0:
        return False
    xx, yy = xx / count - (mean_x / count) ** 2, yy / count - (mean_y / count) ** 2
    xy = xy / count - mean_x * mean_y / (count * count)
    angle = 0.5 * np.arctan2(2.0 * xy, xx - yy)
    return bool(abs(dy * np.cos(angle) - dx * np.sin(angle)) < GRAZING)


@kernel(
    "void(int16[:,::1], int32[:,::1], float32[:,::1], int16[:,::1], int64, float64, float64, float64, float64, float64,"
    " boolean, float64)"
)
def _clear_ray(
    evidence: Int16Array,
    slots: Int32Array,
    surfaces: SingleArray,
    marks: Int16Array,
    scan: int,
    end_x: float,
    end_y: float,
    x: float,
    y: float,
    begin: float,
    gentle: bool,
    resolution: float,
) -> None:
    """Lower the evidence along the ray from (x, y), ``begin`` m on, until one and a half cells before its end.

    ``gentle``: leave occupied cells alone.
    """
    height, width = evidence.shape
    dx, dy = end_x - x, end_y - y
    length = np.sqrt(dx * dx + dy * dy)
    last = (length - begin) / resolution - 1.5
    if last <= 0.0:
        return
    dx, dy = dx / length, dy / length
    cell_x, cell_y = (x + begin * dx) / resolution, (y + begin * dy) / resolution
    col, row = int(np.floor(cell_x)), int(np.floor(cell_y))
    step_col, step_row = (1 if dx > 0 else -1), (1 if dy > 0 else -1)
    per_col = 1.0 / abs(dx) if dx != 0 else np.inf
    per_row = 1.0 / abs(dy) if dy != 0 else np.inf
    next_col = ((col + 1 - cell_x) if dx > 0 else (cell_x - col)) * per_col if dx != 0 else np.inf
    next_row = ((row + 1 - cell_y) if dy > 0 else (cell_y - row)) * per_row if dy != 0 else np.inf
    gone, cells, touched, at, down = 0.0, evidence.reshape(-1), marks.reshape(-1), row * width + col, step_row * width
    while gone < last:
        if not (np.uintp(row) < np.uintp(height) and np.uintp(col) < np.uintp(width)):  # both signs in one comparison
            return
        before = cells[np.uintp(at)]
        if before == EVIDENCE_MIN or touched[np.uintp(at)] == scan or touched[np.uintp(at)] == FROZEN:
            pass  # most floor is as free as can be: its mark need not be looked up
        elif before <= 0 or not (gentle or _is_grazed(evidence, slots, surfaces, row, col, dx, dy, resolution)):
            touched[np.uintp(at)] = scan
            value = max(EVIDENCE_MIN, before + MISS)
            cells[np.uintp(at)] = value if value != 0 else -1
        if next_col < next_row:
            gone = next_col
            next_col += per_col
            col += step_col
            at += step_col
        else:
            gone = next_row
            next_row += per_row
            row += step_row
            at += down


@kernel(
    "void(int16[:,::1], int32[:,::1], float32[:,::1], int16[:,::1], int64, float64[:,::1], int64, float64, float64,"
    " float64)"
)
def _clear_between(
    evidence: Int16Array,
    slots: Int32Array,
    surfaces: SingleArray,
    marks: Int16Array,
    scan: int,
    ends: FloatArray,
    i: int,
    x: float,
    y: float,
    resolution: float,
) -> None:
    """Clear the floor between ray ``i`` and the next one where they are more than a cell apart."""
    j = (i + 1) % ends.shape[0]
    ax, ay, bx, by = ends[i, 0] - x, ends[i, 1] - y, ends[j, 0] - x, ends[j, 1] - y
    a, b = np.sqrt(ax * ax + ay * ay), np.sqrt(bx * bx + by * by)
    shorter = min(a, b)
    if shorter <= 0.0:
        return
    ax, ay, bx, by = ax / a, ay / a, bx / b, by / b
    apart = np.sqrt((ax - bx) ** 2 + (ay - by) ** 2)
    count = min(BETWEEN_MAX, int(shorter * apart / resolution))
    if apart > NEIGHBOURS:
        return
    for k in range(1, count + 1):
        share = k / (count + 1.0)
        end_x, end_y = x + shorter * (ax + share * (bx - ax)), y + shorter * (ay + share * (by - ay))
        _clear_ray(evidence, slots, surfaces, marks, scan, end_x, end_y, x, y, resolution / apart, True, resolution)


@kernel(
    "int64(int16[:,::1], int32[:,::1], float32[:,::1], int64, int16[:,::1], int64, float64[:,::1], uint8[::1],"
    " float64, float64, boolean, float64)",
)
def integrate(
    evidence: Int16Array,
    slots: Int32Array,
    surfaces: SingleArray,
    used: int,
    marks: Int16Array,
    scan: int,
    ends: FloatArray,
    hit: ByteArray,
    x: float,
    y: float,
    fill: bool,
    resolution: float,
) -> int:
    """Add one scan taken at (x, y): ``ends`` are the rays' ends, occupied where ``hit``; metres from the grid's corner.

    A cell changes once per scan at most; a hit wins over rays that pass, and those over the gaps between rays, which
    are cleared if ``fill``. Ends outside the grid are clipped. ``used``: how many rows of ``surfaces`` are in use, with
    the first one, which no cell has; there must be one more for each hit. Returns how many are in use then.
    """
    height, width = evidence.shape
    for i in range(ends.shape[0]):
        if hit[i] == 0:
            continue
        col = int(np.floor(ends[i, 0] / resolution))
        row = int(np.floor(ends[i, 1] / resolution))
        if row < 0 or col < 0 or row >= height or col >= width:
            continue
        if marks[row, col] == FROZEN:
            continue
        if slots[row, col] == 0:
            slots[row, col], used = used, used + 1
        slot = slots[row, col]
        if marks[row, col] != scan:
            marks[row, col] = scan
            if not is_surface(evidence, row, col):  # what stood there has gone
                for part in range(surfaces.shape[1]):
                    surfaces[slot, part] = 0.0
            evidence[row, col] = min(EVIDENCE_MAX, evidence[row, col] + HIT)
            if evidence[row, col] == 0:
                evidence[row, col] = 1
        if surfaces[slot, 0] < HITS_MAX:
            dx, dy = x - ends[i, 0], y - ends[i, 1]
            away = max(np.sqrt(dx * dx + dy * dy), 1e-9)
            surfaces[slot, 0] += 1.0
            surfaces[slot, 1] += ends[i, 0] - col * resolution
            surfaces[slot, 2] += ends[i, 1] - row * resolution
            surfaces[slot, 3] += dx / away
            surfaces[slot, 4] += dy / away
    for i in range(ends.shape[0]):
        _clear_ray(evidence, slots, surfaces, marks, scan, ends[i, 0], ends[i, 1], x, y, 0.0, False, resolution)
    for i in range(ends.shape[0] if fill else 0):
        _clear_between(evidence, slots, surfaces, marks, scan, ends, i, x, y, resolution)
    return used


WIDE = 3.0  # cells to either side of a ray over which a surface must extend for the ray to cross it
UNKNOWN, FITTING, HIDDEN, FLOATING, CROSSING = 0, 1, 2, 3, 4  # the map's verdict on an echo


@kernel("boolean(int16[:,::1], float64, float64)")
def _is_occupied_near(evidence: Int16Array, col: float, row: float) -> bool:
    """Return True if the cell at (col, row) or one beside it is occupied."""
    middle_row, middle_col = int(np.floor(row)), int(np.floor(col))
    for r in range(max(0, middle_row - 1), min(evidence.shape[0], middle_row + 2)):
        for c in range(max(0, middle_col - 1), min(evidence.shape[1], middle_col + 2)):
            if evidence[r, c] > 0:
                return True
    return False


@kernel("boolean(int16[:,::1], float64, float64, float64, float64, float64, boolean, float64)")
def _is_pierced(
    evidence: Int16Array, x: float, y: float, end_x: float, end_y: float, slack: float, wide: bool, resolution: float
) -> bool:
    """Return True if the ray passes through an occupied cell more than ``slack`` m before its end.

    ``wide``: only where the surface goes on to both sides of the ray, so that it does not just touch an edge.
    """
    dx, dy = end_x - x, end_y - y
    length = np.sqrt(dx * dx + dy * dy)
    for k in range(1, int((length - slack) / resolution)):
        at_col, at_row = x / resolution + dx * k / length, y / resolution + dy * k / length
        col, row = int(np.floor(at_col)), int(np.floor(at_row))
        if row < 0 or col < 0 or row >= evidence.shape[0] or col >= evidence.shape[1] or evidence[row, col] <= 0:
            continue
        left, ahead = -dy / length * WIDE, dx / length * WIDE
        if not wide or (
            _is_occupied_near(evidence, at_col + left, at_row + ahead)
            and _is_occupied_near(evidence, at_col - left, at_row - ahead)
        ):
            return True
    return False


@kernel("uint8[::1](int16[:,::1], float64[:,::1], float64, float64, float64, float64)")
def verdicts(
    evidence: Int16Array, points: FloatArray, x: float, y: float, slack: float, resolution: float
) -> ByteArray:
    """Return the map's verdict on each echo at ``points`` (n, 2; m from the grid's corner), seen from (x, y).

    FITTING: on or beside an occupied cell; CROSSING: so, but the ray passes through a wall more than ``slack`` m before
    its end; HIDDEN: not so, behind a wall; FLOATING: in the midst of floor that was seen free; else UNKNOWN.
    """
    height, width = evidence.shape
    near = int(np.ceil(slack / resolution))
    said = np.zeros(points.shape[0], np.uint8)
    for i in range(points.shape[0]):
        col, row = int(np.floor(points[i, 0] / resolution)), int(np.floor(points[i, 1] / resolution))
        occupied = unknown = False
        for r in range(row - near, row + near + 1):
            for c in range(col - near, col + near + 1):
                if r < 0 or c < 0 or r >= height or c >= width:
                    unknown = True
                elif evidence[r, c] > 0:
                    occupied = True
                elif evidence[r, c] == 0:
                    unknown = True
        if _is_pierced(evidence, x, y, points[i, 0], points[i, 1], slack, occupied, resolution):
            said[i] = CROSSING if occupied else HIDDEN
        elif occupied:
            said[i] = FITTING
        elif not unknown:
            said[i] = FLOATING
    return said


@kernel("boolean[::1](float64[:,::1], float64, float64, float64, float64[:,::1])")
def outside(ends: FloatArray, x: float, y: float, yaw: float, discs: FloatArray) -> BoolArray:
    """Return which ``ends`` (n, 2; m), in a frame at (x, y, yaw), lie in none of the ``discs`` (x, y, radius)."""
    found, cos, sin = np.ones(len(ends), np.bool_), np.cos(yaw), np.sin(yaw)
    for i in range(len(ends)):
        at_x, at_y = cos * ends[i, 0] - sin * ends[i, 1] + x, sin * ends[i, 0] + cos * ends[i, 1] + y
        for k in range(len(discs)):
            dx, dy = at_x - discs[k, 0], at_y - discs[k, 1]
            found[i] &= dx * dx + dy * dy > discs[k, 2] * discs[k, 2]
    return found


@kernel(
    "Tuple((float64[:,::1], uint8[::1], float64[:,::1]))"
    "(float64[::1], float64[::1], float64[::1], float64, float64, float64, float64, float64, float64)"
)
def rays_of(
    ranges: FloatArray,
    cosines: FloatArray,
    sines: FloatArray,
    low: float,
    high: float,
    clear: float,
    x: float,
    y: float,
    least: float,
) -> tuple[FloatArray, ByteArray, FloatArray]:
    """Return the usable rays of a scan from (x, y): ends (n, 2; m), 1 where there was an echo, the echoes.

    An echo lies between ``low`` and ``high``; rays beyond end at ``clear``, others are left out. Nothing is returned
    if less than the share ``least`` of all has an echo.
    """
    count = echoes = 0
    for ray in range(len(ranges)):
        echoes += low <= ranges[ray] <= high
        count += ranges[ray] >= low or ranges[ray] > high
    if echoes < least * len(ranges):
        count = echoes = 0
    ends, hit, points = np.empty((count, 2)), np.empty(count, np.uint8), np.empty((echoes, 2))
    at = met = 0
    for ray in range(len(ranges) if count else 0):
        away = ranges[ray]
        is_echo = low <= away <= high
        if not (is_echo or away > high):
            continue
        away = away if is_echo else clear
        ends[at, 0], ends[at, 1], hit[at] = cosines[ray] * away + x, sines[ray] * away + y, is_echo
        if is_echo:
            points[met, 0], points[met, 1] = ends[at, 0], ends[at, 1]
            met += 1
        at += 1
    return ends, hit, points


@kernel("int16[:,::1](int16[:,::1], int64)")
def without_things(evidence: Int16Array, size: int) -> Int16Array:
    """Return a copy without occupied things that are at most ``size`` cells long and wide and touch nothing else.

    What touches: cells with at most one free cell between them belong together, as an echo's neighbours do.
    """
    height, width = evidence.shape
    kept = evidence.copy()
    visited = np.zeros((height, width), np.uint8)
    cells = np.empty((height * width, 2), np.int32)
    for row in range(height):
        for col in range(width):
            if evidence[row, col] <= 0 or visited[row, col]:
                continue
            count, at = 1, 0
            cells[0, 0], cells[0, 1] = row, col
            visited[row, col] = 1
            top, bottom, left, right = row, row, col, col
            while at < count:
                r0, c0 = cells[at, 0], cells[at, 1]
                at += 1
                top, bottom, left, right = min(top, r0), max(bottom, r0), min(left, c0), max(right, c0)
                for r in range(max(0, r0 - 2), min(height, r0 + 3)):
                    for c in range(max(0, c0 - 2), min(width, c0 + 3)):
                        if evidence[r, c] > 0 and not visited[r, c]:
                            visited[r, c] = 1
                            cells[count, 0], cells[count, 1] = r, c
                            count += 1
            if bottom - top < size and right - left < size:
                for k in range(count):
                    kept[cells[k, 0], cells[k, 1]] = -1
    return kept


@kernel("Tuple((float64[:,::1], float64, float64, float64, float64))(float64[:,::1], float64, float64, float64)")
def placed(ends: FloatArray, x: float, y: float, yaw: float) -> tuple[FloatArray, float, float, float, float]:
    """Return ``ends`` (n, 2) in the frame in which theirs is at (x, y, yaw), and least and greatest x, then y."""
    cos, sin = np.cos(yaw), np.sin(yaw)
    found, low_x, high_x, low_y, high_y = np.empty(ends.shape), np.inf, -np.inf, np.inf, -np.inf
    for i in range(ends.shape[0]):
        at_x, at_y = ends[i, 0] * cos - ends[i, 1] * sin + x, ends[i, 0] * sin + ends[i, 1] * cos + y
        found[i, 0], found[i, 1] = at_x, at_y
        low_x, high_x, low_y, high_y = min(low_x, at_x), max(high_x, at_x), min(low_y, at_y), max(high_y, at_y)
    return found, low_x, high_x, low_y, high_y
