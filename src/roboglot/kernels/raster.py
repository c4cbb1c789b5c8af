"""Rasterizer: culls, clips and projects quads and fills a depth buffer with their numbers, without colours.

Camera frame: x right, y down, z forward. A plane seen through a pixel is linear in 1/z, and texture coordinates times
1/z are too, so a polygon is kept as eleven coefficients: 1/z = p0 x + p1 y + p2, u = (p3 x + p4 y + p5) z + p6, v = (p7
x + p8 y + p9) z + p10, with x, y in pixels.
"""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import ByteArray, FloatArray, Int32Array, SingleArray, Uint16Array
from roboglot.kernels.compiled import kernel

NEAR = 0.03  # m in front of the eye


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


@kernel()
def _fill(
    polygon: FloatArray,
    count: int,
    number: int,
    plane: FloatArray,
    ends: FloatArray,
    depth: SingleArray,
    seen: Uint16Array,
) -> None:
    """Write ``number`` wherever the projected polygon (pixels) is the nearest so far."""
    height, width = depth.shape
    low, high = polygon[0, 1], polygon[0, 1]
    for i in range(1, count):
        low, high = min(low, polygon[i, 1]), max(high, polygon[i, 1])
    first = int(np.ceil(min(max(low - 0.5, 0.0), float(height))))
    last = int(np.ceil(min(max(high - 0.5, 0.0), float(height))))
    for y in range(first, last):
        ends[y, 0], ends[y, 1] = 1e9, -1e9
    for i in range(count):
        j = i + 1 if i + 1 < count else 0
        x0, y0, x1, y1 = polygon[i, 0], polygon[i, 1], polygon[j, 0], polygon[j, 1]
        if y0 > y1:
            x0, y0, x1, y1 = x1, y1, x0, y0
        top = max(first, int(np.ceil(max(y0 - 0.5, -1.0))))
        bottom = min(last, int(np.ceil(min(y1 - 0.5, float(height)))))
        if top >= bottom:
            continue
        slope = (x1 - x0) / (y1 - y0)
        for y in range(top, bottom):
            x = x0 + (y + 0.5 - y0) * slope
            ends[y, 0], ends[y, 1] = min(ends[y, 0], x), max(ends[y, 1], x)
    step = np.float32(plane[0])
    value = np.uint16(number)
    for y in range(first, last):
        left = int(np.ceil(min(max(ends[y, 0] - 0.5, 0.0), float(width))))
        right = int(np.ceil(min(max(ends[y, 1] - 0.5, 0.0), float(width))))
        start = np.float32(plane[0] * (left + 0.5) + plane[1] * (y + 0.5) + plane[2])
        for x in range(left, right):
            near = start + step * np.float32(x - left)
            if near > depth[np.uintp(y), np.uintp(x)]:
                depth[np.uintp(y), np.uintp(x)] = near
                seen[np.uintp(y), np.uintp(x)] = value


@kernel(
    "int64(float64[:,:,::1], float64[:,:,::1], int32[::1], uint8[::1], float64[:,::1], float64[::1], float64[::1],"
    " float64[:,::1], int32[::1], float32[:,::1], uint16[:,::1], int64)",
)
def draw(
    corners: FloatArray,
    mappings: FloatArray,
    rooms: Int32Array,
    visible: ByteArray,
    rotation: FloatArray,
    eye: FloatArray,
    lens: FloatArray,
    planes: FloatArray,
    sources: Int32Array,
    depth: SingleArray,
    seen: Uint16Array,
    first: int,
) -> int:
    """Draw quads (n x 4 x 3, world, counter-clockwise from outside) of rooms that are ``visible``; returns how many.

    The k-th drawn one is number first + k in ``seen``; its coefficients are ``planes[first + k]``, its index among the
    quads ``sources[first + k]``. ``mappings``: texture origin and the two axes (1/m) in world. ``lens``: focal length,
    middle x, middle y in pixels. ``depth`` (1/m) and ``seen`` begin with all 0 and ``first`` with FIRST; more can be
    drawn into them behind what was drawn before. Quads beyond the length of ``planes`` are left out.
    """
    height, width = depth.shape
    quad, polygon = np.empty((4, 3)), np.empty((8, 3))
    ends = np.empty((height, 2))
    number, focal, cx, cy = first, lens[0], lens[1], lens[2]
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
        for i in range(count):
            polygon[i, 0] = cx + focal * polygon[i, 0] / polygon[i, 2]
            polygon[i, 1] = cy + focal * polygon[i, 1] / polygon[i, 2]
        sources[number] = index
        _fill(polygon, count, number, planes[number], ends, depth, seen)
        number += 1
    return number - first
