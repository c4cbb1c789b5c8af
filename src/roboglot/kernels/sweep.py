"""A lidar's turn: rays against edges and circles in the plane, exactly, and noise. Compiled twins of the simulation's
own functions.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.kernels.arrays import FloatArray, SingleArray
from roboglot.kernels.compiled import kernel

GRAZE = 1e-9  # m2: an edge seen end-on, which rounding could place anywhere, even at the eye


@kernel("boolean(float64[::1], float64, float64, float64, float64, float64)")
def _hidden(ranges: FloatArray, x: float, y: float, sine: float, near: float, step: float) -> bool:
    """True if all rays that might meet a circle end before it; (x, y) points to it, ``sine`` is of half its angle.

    Looks at some rays too many: the angle comes from a polynomial that is ten times as quick as the arc tangent.
    """
    rays = len(ranges)
    if sine > 0.5 or not x * x + y * y > 0.0:
        return False
    steep = abs(y) > abs(x)
    slope = abs(x) / abs(y) if steep else abs(y) / abs(x)
    square = slope * slope
    angle = ((-0.0464964749 * square + 0.15931422) * square - 0.327622764) * square * slope + slope
    angle = 0.5 * math.pi - angle if steep else angle
    angle = math.pi - angle if x < 0.0 else angle
    angle = (-angle if y < 0.0 else angle) + math.pi
    half = 1.05 * sine + 0.002  # the arc sine of values up to a half is at most 1.048 times the value
    begin, end = math.floor((angle - half) / step), math.ceil((angle + half) / step)
    for number in range(begin, end + 1):
        ray = number + rays if number < 0 else number
        if ranges[ray - rays if ray >= rays else ray] > near:
            return False
    return True


@kernel("float64[::1](float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, float64)")
def sweep(
    edges: FloatArray, circles: FloatArray, directions: FloatArray, x: float, y: float, yaw: float, reach: float
) -> FloatArray:
    """Distances (m) from (x, y) along ``directions``, turned by ``yaw``; inf beyond ``reach``.

    ``directions`` (rays, 2) begin at -pi and go round evenly. ``edges`` (n, 4) have their solid to the left of the way
    from the first to the second end; ``circles`` (n, 4) are x, y, radius, 0. Only the outsides of solids are seen.
    """
    rays = directions.shape[0]
    ranges = np.empty(rays)
    for i in range(rays):
        ranges[i] = np.inf
    step = 2.0 * math.pi / rays
    cos, sin = math.cos(yaw), math.sin(yaw)
    for i in range(edges.shape[0]):
        dx, dy, ex, ey = edges[i, 0] - x, edges[i, 1] - y, edges[i, 2] - x, edges[i, 3] - y
        area = dy * ex - dx * ey
        along_x, along_y = ex - dx, ey - dy
        if area <= GRAZE or area * area > reach * reach * (along_x * along_x + along_y * along_y):
            continue
        first = math.atan2(cos * ey - sin * ex, cos * ex + sin * ey)
        span = math.atan2(area, dx * ex + dy * ey)
        turned_x, turned_y = cos * along_x + sin * along_y, cos * along_y - sin * along_x
        begin = math.ceil((first + math.pi) / step)
        ray = begin - 1 if begin >= 0 else begin + rays - 1
        for _ in range(begin, math.floor((first + span + math.pi) / step) + 1):
            ray = ray + 1 if ray + 1 < rays else 0
            across = turned_x * directions[ray, 1] - turned_y * directions[ray, 0]
            if across != 0.0:
                ranges[ray] = min(ranges[ray], abs(area / across))
    for i in range(circles.shape[0]):
        dx, dy, radius = circles[i, 0] - x, circles[i, 1] - y, circles[i, 2]
        away = math.sqrt(dx * dx + dy * dy)
        if away <= radius or away - radius >= reach:
            continue
        middle_x, middle_y = cos * dx + sin * dy, cos * dy - sin * dx
        if _hidden(ranges, middle_x, middle_y, radius / away, away - radius, step):
            continue
        half = math.asin(radius / away)
        first = math.atan2(middle_y, middle_x) - half
        begin = math.ceil((first + math.pi) / step)
        ray = begin - 1 if begin >= 0 else begin + rays - 1
        for _ in range(begin, math.floor((first + 2.0 * half + math.pi) / step) + 1):
            ray = ray + 1 if ray + 1 < rays else 0
            if ranges[ray] <= away - radius:
                continue  # occluded, as usual indoors
            along = middle_x * directions[ray, 0] + middle_y * directions[ray, 1]
            miss = middle_y * directions[ray, 0] - middle_x * directions[ray, 1]
            ranges[ray] = min(ranges[ray], along - math.sqrt(max(0.0, radius * radius - miss * miss)))
    for ray in range(rays):
        if ranges[ray] > reach:
            ranges[ray] = np.inf
    return ranges


@kernel("float32[::1](float64[::1], float32[::1], float64, float64, float64)")
def blur(exact: FloatArray, noise: SingleArray, sigma: float, low: float, high: float) -> SingleArray:
    """Distances with ``noise`` (standard normal) of ``sigma`` m; NaN below ``low``, inf beyond ``high``."""
    ranges = np.empty_like(noise)
    spread, nearest, farthest = np.float32(sigma), np.float32(low), np.float32(high)
    for ray in range(len(noise)):
        told = np.float32(exact[ray] + np.float64(noise[ray] * spread))
        if told < nearest:
            ranges[ray] = np.float32(np.nan)
        else:
            ranges[ray] = told if told <= farthest else np.float32(np.inf)
    return ranges


@kernel(
    "void(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float32[:,::1],"
    " float64, float64, float64, float64)"
)
def turns(
    edges: FloatArray,
    circles: FloatArray,
    directions: FloatArray,
    eyes: FloatArray,
    readings: SingleArray,
    reach: float,
    sigma: float,
    low: float,
    high: float,
) -> None:
    """Turn the noise in each row of ``readings`` into what ``sweep`` and ``blur`` return for a row of ``eyes``.

    Those are x, y and yaw.
    """
    for i in range(eyes.shape[0]):
        exact = sweep(edges, circles, directions, eyes[i, 0], eyes[i, 1], eyes[i, 2], reach)
        readings[i] = blur(exact, readings[i], sigma, low, high)
