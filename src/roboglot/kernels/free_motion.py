"""Motion of robots that nothing can touch: what MuJoCo's ``implicitfast`` computes for them, written out.

Such a robot has no constraints, and its axes are independent but for chassis and torso, which move along z together.
The results agree with MuJoCo's up to rounding and take a hundredth of its time. Columns are those of ``layouts``.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.layouts import (
    HULL_A,
    HULL_DRIVE_X,
    HULL_DRIVE_Y,
    HULL_FLOOR,
    HULL_HELD,
    HULL_LOOKUP_X,
    HULL_LOOKUP_Y,
    HULL_ON_SPRING,
    HULL_Q,
    HULL_RADIUS,
    HULL_TORSO,
    HULL_TORSO_CONTROL,
    HULL_TORSO_V,
    HULL_V,
    HULL_VX,
    HULL_VY,
    HULL_VZ,
    HULL_WALLS,
    HULL_X,
    HULL_Y,
)

STILL = 1e-6  # m/s


@kernel("float64(float64, float64, float64, float64, float64, float64)")
def _outside(dx: float, dy: float, c: float, s: float, half_x: float, half_y: float) -> float:
    """Return the square of the distance from a rectangle's surface; (dx, dy) from its middle, turned by (c, s)."""
    along, aside = abs(c * dx + s * dy) - half_x, abs(c * dy - s * dx) - half_y
    along, aside = max(0.0, along), max(0.0, aside)
    return along * along + aside * aside


@kernel("float64(float64[:,::1], float64, float64, int64)")
def room(walls: FloatArray, x: float, y: float, floor: int) -> float:
    """Return the distance (m) from a place to the nearest of the floor's ``walls``; inf: there is none."""
    least = np.inf
    for w in range(walls.shape[0]):
        if walls[w, 6] == floor:
            off = _outside(x - walls[w, 0], y - walls[w, 1], walls[w, 2], walls[w, 3], walls[w, 4], walls[w, 5])
            least = min(least, off)
    return math.sqrt(least)


@kernel("boolean(float64[:,::1], float64[::1], float64[::1], float64[:,::1])")
def _meet_walls(hulls: FloatArray, reach: FloatArray, rests: FloatArray, walls: FloatArray) -> bool:
    """Return whether a hull that moves reaches one of ``walls``: rows x, y, cosine and sine of yaw, sizes, floor."""
    for i in range(hulls.shape[0]):
        if rests[i] != 0.0:
            continue
        x, y = hulls[i, HULL_X], hulls[i, HULL_Y]
        if hulls[i, HULL_WALLS] - abs(x - hulls[i, HULL_LOOKUP_X]) - abs(y - hulls[i, HULL_LOOKUP_Y]) > reach[i]:
            continue
        for w in range(walls.shape[0]):
            if walls[w, 6] == hulls[i, HULL_FLOOR]:
                off = _outside(x - walls[w, 0], y - walls[w, 1], walls[w, 2], walls[w, 3], walls[w, 4], walls[w, 5])
                if off <= reach[i] * reach[i]:
                    return True
    return False


@kernel(
    "boolean(float64[:,::1], float64[::1], float64[::1], float64[:,::1], float64[:,::1], float64[:,::1], int64[::1],"
    " float64)"
)
def _meet_movables(
    hulls: FloatArray,
    reach: FloatArray,
    rests: FloatArray,
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    geoms: IntArray,
    lowest: float,
) -> bool:
    """Return whether a hull reaches a person (``geoms`` below 0: -1 - geom), or one that moves reaches a box.

    Those below ``lowest`` are away. ``places`` and ``turns`` (quaternions around z) are MuJoCo's of movable bodies,
    ``sizes`` those of all its geoms.
    """
    for m in range(places.shape[0]):
        if places[m, 2] < lowest:
            continue
        person = geoms[m] < 0
        geom = -1 - geoms[m] if person else geoms[m]
        w, z = turns[m, 0], turns[m, 3]
        c, s = w * w - z * z, 2.0 * w * z
        for i in range(hulls.shape[0]):
            if rests[i] != 0.0 and not person:
                continue
            dx, dy, room = hulls[i, HULL_X] - places[m, 0], hulls[i, HULL_Y] - places[m, 1], reach[i]
            if person:
                room += sizes[geom, 0]
                off = dx * dx + dy * dy
            else:
                off = _outside(dx, dy, c, s, sizes[geom, 0], sizes[geom, 1])
            if off <= room * room:
                return True
    return False


@kernel(
    "boolean(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], int64[::1],"
    " float64, float64, float64, boolean)"
)
def clear(
    hulls: FloatArray,
    walls: FloatArray,
    places: FloatArray,
    turns: FloatArray,
    sizes: FloatArray,
    geoms: IntArray,
    lowest: float,
    margin: float,
    seconds: float,
    known: bool,
) -> bool:
    """Return whether all hulls stand on springs and come near nothing within ``seconds``. Treats floors as one.

    ``margin`` (m) covers what speed may gain meanwhile, and shapes that report contacts from afar. ``known``: contacts
    were searched when all was as it is: hulls that rest touch nothing else that rests.
    """
    robots = hulls.shape[0]
    reach, rests = np.empty(robots), np.empty(robots)
    for i in range(robots):
        if hulls[i, HULL_ON_SPRING] == 0.0:
            return False
        vx, vy = hulls[i, HULL_VX], hulls[i, HULL_VY]
        reach[i] = hulls[i, HULL_RADIUS] + margin + seconds * math.sqrt(vx * vx + vy * vy)
        pulls = hulls[i, HULL_HELD] == 0.0 and (hulls[i, HULL_DRIVE_X] != 0.0 or hulls[i, HULL_DRIVE_Y] != 0.0)
        still = max(abs(vx), abs(vy), abs(hulls[i, HULL_VZ])) < STILL
        rests[i] = 1.0 if known and still and not pulls else 0.0
    for i in range(robots):
        x, y, mine = hulls[i, HULL_X], hulls[i, HULL_Y], reach[i]
        for j in range(i):
            dx, dy, room = hulls[j, HULL_X] - x, hulls[j, HULL_Y] - y, reach[j] + mine
            if dx * dx + dy * dy <= room * room and not (rests[i] != 0.0 and rests[j] != 0.0):
                return False
    if _meet_movables(hulls, reach, rests, places, turns, sizes, geoms, lowest):
        return False
    return not _meet_walls(hulls, reach, rests, walls)


@kernel("float64(int64, float64, float64, float64, float64[:,::1], float64[:,::1], float64[:,::1])")
def _pull(
    a: int, control: float, place: float, rate: float, gains: FloatArray, biases: FloatArray, limits: FloatArray
) -> float:
    """Return the force of a servo, within its limits, if it has some."""
    force = float(gains[a, 0] * control + biases[a, 0] + biases[a, 1] * place + biases[a, 2] * rate)
    low, high = float(limits[a, 0]), float(limits[a, 1])
    return min(high, max(low, force)) if low < high else force


@kernel("float64(int64, float64, float64[:,::1], float64[:,::1])")
def _yield_of(a: int, force: float, biases: FloatArray, limits: FloatArray) -> float:
    """Return the damping by a servo: none while its force is at a limit."""
    low, high = limits[a, 0], limits[a, 1]
    return float(-biases[a, 2]) if not low < high or low < force < high else 0.0


@kernel(
    "boolean(float64[:,::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[::1], float64[::1],"
    " float64[::1], float64[:,::1], float64[::1], float64[::1], float64[::1], float64[:,::1], float64[:,::1],"
    " float64[:,::1], float64, float64, int64)"
)
def advance(
    hulls: FloatArray,
    uprights: FloatArray,
    positions: FloatArray,
    velocities: FloatArray,
    controls: FloatArray,
    accelerations: FloatArray,
    forces: FloatArray,
    masses: FloatArray,
    ranges: FloatArray,
    slack: FloatArray,
    stiffness: FloatArray,
    damping: FloatArray,
    gains: FloatArray,
    biases: FloatArray,
    limits: FloatArray,
    gravity: float,
    step: float,
    steps: int,
) -> bool:
    """Move all hulls on by ``steps`` steps of ``step`` s; do nothing and return False if a torso reaches its stops.

    ``uprights`` (robots, 7) is room for place, rate and acceleration along z of chassis and torso, and a force. The
    others are MuJoCo's, by position, velocity or control; ``masses``: of all that moves along; ``slack``: of springs.
    """
    for i in range(hulls.shape[0]):
        q, v, t = int(hulls[i, HULL_Q]) + 2, int(hulls[i, HULL_V]) + 2, int(hulls[i, HULL_TORSO])
        sinking, servo = int(hulls[i, HULL_TORSO_V]), int(hulls[i, HULL_TORSO_CONTROL])
        z, vz, az, torso, vt, at, force = positions[q], velocities[v], 0.0, 0.0, 0.0, 0.0, 0.0
        whole, part, stiff, soft = masses[v], 0.0, stiffness[v], damping[v]
        if t >= 0:
            torso, vt, part = positions[t], velocities[sinking], masses[sinking]
        for _ in range(steps):
            pull = -whole * gravity - stiff * (z - slack[q]) - soft * vz
            if t >= 0:
                if torso <= ranges[sinking, 0] or torso >= ranges[sinking, 1]:
                    return False
                force = _pull(servo, controls[servo], torso, vt, gains, biases, limits)
                lift = force - part * gravity - damping[sinking] * vt
                a = whole + step * soft
                b = part + step * (damping[sinking] + _yield_of(servo, force, biases, limits))
                at = (a * lift - part * pull) / (a * b - part * part)
                vt += step * at
                torso += step * vt
            az = (pull - part * at) / (whole + step * soft)
            vz += step * az
            z += step * vz
        row = uprights[i]
        row[0], row[1], row[2], row[3], row[4], row[5], row[6] = z, vz, az, torso, vt, at, force
    for i in range(hulls.shape[0]):
        q, v, t, row = int(hulls[i, HULL_Q]), int(hulls[i, HULL_V]), int(hulls[i, HULL_TORSO]), uprights[i]
        positions[q + 2], velocities[v + 2], accelerations[v + 2] = row[0], row[1], row[2]
        if t >= 0:
            sinking = int(hulls[i, HULL_TORSO_V])
            positions[t], velocities[sinking], accelerations[sinking] = row[3], row[4], row[5]
            forces[int(hulls[i, HULL_TORSO_CONTROL])] = row[6]
        for k in range(3):
            axis, a = (3 if k == 2 else k), int(hulls[i, HULL_A]) + k
            place, rate, mass, acceleration = positions[q + axis], velocities[v + axis], masses[v + axis], 0.0
            for _ in range(steps):
                force = _pull(a, controls[a], place, rate, gains, biases, limits)
                acceleration = force / (mass + step * _yield_of(a, force, biases, limits))
                rate += step * acceleration
                place += step * rate
                forces[a] = force
            positions[q + axis], velocities[v + axis], accelerations[v + axis] = place, rate, acceleration
    return True
