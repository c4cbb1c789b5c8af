"""Rasterizer: finds visible rooms, projects quads, fills a depth buffer with their numbers, without colours.

Camera frame: x right, y down, z forward. A plane seen through a pixel is linear in 1/z, and texture coordinates times
1/z are too, so a polygon is kept as eleven coefficients: 1/z = p0 x + p1 y + p2, u = (p3 x + p4 y + p5) z + p6, v = (p7
x + p8 y + p9) z + p10, with x, y in pixels.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, SingleArray, Uint16Array
from roboglot.kernels.compiled import kernel
from roboglot.kernels.lanes import LANES, MARGIN, cover
from roboglot.kernels.layouts import FIRST

NEAR = 0.03  # m in front of the eye
ROOMS_MAX = 255  # room 0 is outside
CORNERS_MAX = 8  # of a quad that is cut off before the eye


@kernel()
def _clipped(quad: FloatArray, polygon: FloatArray) -> int:
    """Write the part of ``quad`` (4 x 3, camera frame) in front of NEAR to ``polygon``; return its corners' number."""
    count = 0
    for i in range(4):
        j = (i + 1) & 3
        here, there = quad[i, 2] - NEAR, quad[j, 2] - NEAR
        if here >= 0.0:
            polygon[count, 0], polygon[count, 1], polygon[count, 2] = quad[i, 0], quad[i, 1], quad[i, 2]
            count += 1
        if (here < 0.0) != (there < 0.0):
            part = here / (here - there)
            for axis in range(3):
                polygon[count, axis] = quad[i, axis] + part * (quad[j, axis] - quad[i, axis])
            count += 1
    return count


@kernel()
def _plane(
    quad: FloatArray, mapping: FloatArray, rotation: FloatArray, eye: FloatArray, lens: FloatArray, plane: FloatArray
) -> bool:
    """Fill in the coefficients of a quad's plane; return False if it is seen from behind or edge on."""
    ax, ay, az = quad[1, 0] - quad[0, 0], quad[1, 1] - quad[0, 1], quad[1, 2] - quad[0, 2]
    bx, by, bz = quad[2, 0] - quad[0, 0], quad[2, 1] - quad[0, 1], quad[2, 2] - quad[0, 2]
    nx, ny, nz = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
    away = nx * quad[0, 0] + ny * quad[0, 1] + nz * quad[0, 2]
    if away >= -1e-9:
        return False
    focal, cx, cy = lens[0], lens[1], lens[2]
    plane[0] = nx / away / focal
    plane[1] = ny / away / focal
    plane[2] = nz / away - plane[0] * cx - plane[1] * cy
    for axis in range(2):
        along = mapping[1 + axis]
        at = 3 + 4 * axis
        right = rotation[0, 0] * along[0] + rotation[0, 1] * along[1] + rotation[0, 2] * along[2]
        down = rotation[1, 0] * along[0] + rotation[1, 1] * along[1] + rotation[1, 2] * along[2]
        ahead = rotation[2, 0] * along[0] + rotation[2, 1] * along[1] + rotation[2, 2] * along[2]
        plane[at] = right / focal
        plane[at + 1] = down / focal
        plane[at + 2] = ahead - plane[at] * cx - plane[at + 1] * cy
        plane[at + 3] = 0.0
        for i in range(3):
            plane[at + 3] += (eye[i] - mapping[0, i]) * along[i]
    return True


@kernel(
    "int64(float64[:,:,::1], float64[:,:,::1], int32[::1], uint8[::1], float64[:,::1], float64[::1], float64[::1],"
    " float64[:,::1], int32[::1], float64[:,:,::1], int32[:,::1], int64)",
)
def project(
    corners: FloatArray,
    mappings: FloatArray,
    rooms: Int32Array,
    visible: ByteArray,
    rotation: FloatArray,
    eye: FloatArray,
    lens: FloatArray,
    planes: FloatArray,
    sources: Int32Array,
    outlines: FloatArray,
    spans: Int32Array,
    first: int,
) -> int:
    """Project quads (n x 4 x 3, world, counter-clockwise from outside) of rooms that are ``visible``; return how many.

    The k-th that may be in the picture is polygon first + k: its coefficients are ``planes[first + k]``, its index
    among the quads ``sources[first + k]``, its corners in pixels ``outlines[first + k]``, and ``spans[first + k]`` are
    the number of its corners, its first row, and the one behind its last. ``mappings``: texture origin and the two axes
    (1/m) in world. ``lens``: focal length, middle x, middle y in pixels. Quads beyond ``planes`` are left out.
    """
    quad, polygon = np.empty((4, 3)), np.empty((CORNERS_MAX, 3))
    number, focal, cx, cy = first, lens[0], lens[1], lens[2]
    width, height = 2.0 * cx, 2.0 * cy
    for index in range(corners.shape[0]):
        if visible[rooms[index]] == 0:
            continue
        if number >= planes.shape[0]:
            break
        left, right, above, below, behind = 0, 0, 0, 0, 0
        for i in range(4):
            dx, dy, dz = corners[index, i, 0] - eye[0], corners[index, i, 1] - eye[1], corners[index, i, 2] - eye[2]
            x = rotation[0, 0] * dx + rotation[0, 1] * dy + rotation[0, 2] * dz
            y = rotation[1, 0] * dx + rotation[1, 1] * dy + rotation[1, 2] * dz
            z = rotation[2, 0] * dx + rotation[2, 1] * dy + rotation[2, 2] * dz
            quad[i, 0], quad[i, 1], quad[i, 2] = x, y, z
            behind += z < NEAR
            left += x * focal < -cx * z
            right += x * focal > (width - cx) * z
            above += y * focal < -cy * z
            below += y * focal > (height - cy) * z
        if behind == 4 or left == 4 or right == 4 or above == 4 or below == 4:
            continue
        if not _plane(quad, mappings[index], rotation, eye, lens, planes[number]):
            continue
        count = _clipped(quad, polygon)
        low, high = height, 0.0
        for i in range(count):
            outlines[number, i, 0] = cx + focal * polygon[i, 0] / polygon[i, 2]
            y = cy + focal * polygon[i, 1] / polygon[i, 2]
            outlines[number, i, 1] = y
            low, high = min(low, y), max(high, y)
        spans[number, 0] = count
        spans[number, 1] = int(np.ceil(min(max(low - 0.5, 0.0), height)))
        spans[number, 2] = int(np.ceil(min(max(high - 0.5, 0.0), height)))
        sources[number] = index
        number += 1
    return number - first


@kernel(_nrt=False)
def _fill(
    outlines: FloatArray,
    spans: Int32Array,
    planes: FloatArray,
    number: int,
    top: int,
    rows: int,
    ends: FloatArray,
    depth: SingleArray,
    seen: Uint16Array,
) -> None:
    """Write ``number`` wherever that polygon is the nearest so far; row 0 of ``depth`` is ``top`` of the picture."""
    width = depth.shape[1] - MARGIN
    first, last = max(spans[number, 1], top), min(spans[number, 2], top + rows)
    for y in range(first, last):
        ends[y - top, 0], ends[y - top, 1] = 1e9, -1e9
    count = spans[number, 0]
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        x0, y0, x1, y1 = outlines[number, i, 0], outlines[number, i, 1], outlines[number, j, 0], outlines[number, j, 1]
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        begin = max(first, int(np.ceil(min(max(y0 - 0.5, -1.0), 1e6))))
        end = min(last, int(np.ceil(min(max(y1 - 0.5, -1.0), 1e6))))
        if begin >= end:
            continue
        slope = (x1 - x0) / (y1 - y0)
        for y in range(begin, end):
            x = x0 + (y + 0.5 - y0) * slope
            ends[y - top, 0], ends[y - top, 1] = min(ends[y - top, 0], x), max(ends[y - top, 1], x)
    across, down, base = planes[number, 0], planes[number, 1], planes[number, 2]
    step = np.float32(across)
    value = np.uint16(number)
    for y in range(first, last):
        left = int(np.ceil(min(max(ends[y - top, 0] - 0.5, 0.0), float(width))))
        right = int(np.ceil(min(max(ends[y - top, 1] - 0.5, 0.0), float(width))))
        start = np.float32(across * (left + 0.5) + down * (y + 0.5) + base)
        at = (y - top) * depth.shape[1]
        for x in range(left, right, LANES):
            near = np.float32(start + step * np.float32(x - left))
            cover(depth, seen, at + x, near, step, value, np.int32(right - x))


@kernel(
    "void(float64[:,:,::1], int32[:,::1], float64[:,::1], int64, int64, int64, float64[:,::1], float32[:,::1],"
    " uint16[:,::1])",
    _nrt=False,
)
def fill(
    outlines: FloatArray,
    spans: Int32Array,
    planes: FloatArray,
    last: int,
    top: int,
    rows: int,
    ends: FloatArray,
    depth: SingleArray,
    seen: Uint16Array,
) -> None:
    """Draw the polygons FIRST up to ``last``, without it, into ``rows`` rows of a picture from ``top`` on.

    ``depth`` (1/m) and ``seen`` (numbers of polygons, 0: none) get these rows, which are MARGIN longer than the
    picture's; ``ends`` (rows, 2) is scratch space. A band of a few rows stays in the processor's cache.
    """
    for y in range(rows):
        for x in range(depth.shape[1]):
            depth[np.uintp(y), np.uintp(x)] = np.float32(0.0)
            seen[np.uintp(y), np.uintp(x)] = np.uint16(0)
    for number in range(FIRST, last):
        if spans[number, 1] < top + rows and spans[number, 2] > top:
            _fill(outlines, spans, planes, number, top, rows, ends, depth, seen)


@kernel("int64(uint8[:,::1], uint8[:,::1])")
def label(walls: ByteArray, rooms: ByteArray) -> int:
    """Number connected cells that are not ``walls`` 1, 2 … in ``rooms``; wall cells get a neighbour's number.

    Rooms beyond ROOMS_MAX share the last number. Returns how many rooms there are.
    """
    height, width = walls.shape
    stack = np.empty((height * width, 2), dtype=np.int32)
    head, tail, count = 0, 0, 0
    rooms[:] = 0
    for first_row in range(height):
        for first_column in range(width):
            if walls[first_row, first_column] or rooms[first_row, first_column]:
                continue
            count = min(count + 1, ROOMS_MAX)
            begin = tail
            stack[tail, 0], stack[tail, 1] = first_row, first_column
            tail += 1
            rooms[first_row, first_column] = count
            head = begin
            while head < tail:
                row, column = stack[head, 0], stack[head, 1]
                head += 1
                for step in range(4):
                    r, c = row + (step == 0) - (step == 1), column + (step == 2) - (step == 3)
                    if 0 <= r < height and 0 <= c < width and not walls[r, c] and not rooms[r, c]:
                        rooms[r, c] = count
                        stack[tail, 0], stack[tail, 1] = r, c
                        tail += 1
    head = 0  # starting from every free cell, into the walls, breadth first
    while head < tail:
        row, column = stack[head, 0], stack[head, 1]
        head += 1
        for step in range(4):
            r, c = row + (step == 0) - (step == 1), column + (step == 2) - (step == 3)
            if 0 <= r < height and 0 <= c < width and not rooms[r, c]:
                rooms[r, c] = rooms[row, column]
                stack[tail, 0], stack[tail, 1] = r, c
                tail += 1
    return count


@kernel("void(uint8[:,::1], uint8[:,::1], float64, float64, float64, float64, uint8[::1])")
def look(solid: ByteArray, rooms: ByteArray, x: float, y: float, yaw: float, spread: float, visible: ByteArray) -> None:
    """Mark in ``visible`` every room whose cells are met within ``spread`` rad around ``yaw`` before a solid cell.

    (x, y) in cells. The first three cells never stop a look: a wall's cell may reach a little beyond the wall.
    """
    height, width = solid.shape
    rays = max(8, int(spread / 0.006))
    reach = 2 * (height + width)
    for ray in range(rays + 1):
        angle = yaw + spread * (ray / rays - 0.5)
        dx, dy = 0.5 * np.cos(angle), 0.5 * np.sin(angle)
        for step in range(reach):
            column, row = int(np.floor(x + dx * step)), int(np.floor(y + dy * step))
            if column < 0 or row < 0 or column >= width or row >= height:
                break
            visible[rooms[row, column]] = 1
            if step > 6 and solid[row, column]:
                break
