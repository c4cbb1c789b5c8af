"""A tick's arithmetic of all robots of a world at once. Compiled twins of the simulation's own functions.

They give the same numbers, to the last bit: the order of every operation is that of the twin. Rows whose robot is
in an unusual state are left as they are and listed in ``others``, for the twin; the answer is how many are.
Columns are those of ``layouts``.
"""

from __future__ import annotations

import math

from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.layouts import (
    ALONE,
    CONTACT_ANGLE,
    CONTACT_DISTANCE,
    CONTACT_MADE,
    GIMBAL_ACCELERATION,
    GIMBAL_HIGHEST,
    GIMBAL_LOWEST,
    GIMBAL_RATE,
    GIMBAL_SINCE,
    GIMBAL_TOP,
    GIMBAL_TURNED,
    GIMBAL_YAW,
    HULL_A,
    HULL_ANGULAR,
    HULL_BEFORE,
    HULL_BELLY,
    HULL_COUNTED,
    HULL_DRIVE_X,
    HULL_DRIVE_Y,
    HULL_DRIVE_YAW,
    HULL_FLOOR,
    HULL_FREE,
    HULL_GAZE_YAW,
    HULL_GOAL_X,
    HULL_GOAL_Y,
    HULL_GOAL_YAW,
    HULL_HELD,
    HULL_LEANS,
    HULL_LINEAR,
    HULL_LOOKED_X,
    HULL_LOOKED_Y,
    HULL_Q,
    HULL_RADIUS,
    HULL_REST,
    HULL_SINKING,
    HULL_SLACK,
    HULL_SPRUNG,
    HULL_TORSO,
    HULL_TURN,
    HULL_TURNED,
    HULL_V,
    HULL_VX,
    HULL_VY,
    HULL_VZ,
    HULL_WHEEL_X,
    HULL_WHEEL_Y,
    HULL_WHEEL_YAW,
    HULL_X,
    HULL_Y,
    HULL_Z,
    IMU_AT,
    IMU_FELT_X,
    IMU_FELT_Y,
    IMU_FELT_Z,
    IMU_LEANT,
    IMU_MX,
    IMU_MY,
    IMU_MZ,
    IMU_NOISES,
    IMU_RATE,
    IMU_RATES,
    IMU_SCALE,
    IMU_STAMP,
    IMU_TURNED,
    IMU_YAW,
    ODOMETRY_AT,
    ODOMETRY_NOISE,
    ODOMETRY_NOISES,
    ODOMETRY_SCALE_X,
    ODOMETRY_SCALE_Y,
    ODOMETRY_STATE,
    ODOMETRY_STILL,
    STATUS_BLOW,
    STATUS_BLOWS,
    STATUS_SLIPPING,
    STATUS_STAMP,
    TOGETHER,
    USE,
)


@kernel("boolean(float64[::1], float64)")
def still(numbers: FloatArray, least: float) -> bool:
    """Return whether none of ``numbers`` is further from 0 than ``least``; False if there are none."""
    for number in numbers:
        if not -least <= number <= least:
            return False
    return len(numbers) > 0


@kernel("void(float64[::1])")
def _approach(row: FloatArray) -> None:
    """Bring the wheels' velocity a step nearer to its goal, as ``SimulatedBase`` does."""
    dx, dy = row[HULL_GOAL_X] - row[HULL_WHEEL_X], row[HULL_GOAL_Y] - row[HULL_WHEEL_Y]
    dyaw, linear, angular = row[HULL_GOAL_YAW] - row[HULL_WHEEL_YAW], row[HULL_LINEAR], row[HULL_ANGULAR]
    way = math.sqrt(dx * dx + dy * dy)
    if way <= linear and abs(dyaw) <= angular:
        for k in range(3):
            row[HULL_WHEEL_X + k] = row[HULL_GOAL_X + k]
        row[HULL_LINEAR] = row[HULL_ANGULAR] = 0.0
    else:
        part = min(1.0, linear / way) if way > 0.0 else 1.0
        row[HULL_WHEEL_X] += dx * part
        row[HULL_WHEEL_Y] += dy * part
        row[HULL_WHEEL_YAW] += max(-angular, min(angular, dyaw))
    for k in range(3):
        row[HULL_DRIVE_X + k] = row[HULL_WHEEL_X + k]


@kernel("void(float64[:,::1], float64[::1], float64)")
def drive(hulls: FloatArray, controls: FloatArray, seconds: float) -> None:
    """Turn the wheels of all hulls as commanded: write the physics' ``controls`` for the next ``seconds``."""
    for i in range(hulls.shape[0]):
        if hulls[i, HULL_LINEAR] > 0.0:
            _approach(hulls[i])
        first = int(hulls[i, HULL_A])
        if hulls[i, HULL_HELD] != 0.0:
            controls[first] = controls[first + 1] = controls[first + 2] = 0.0
            continue
        vx, vy, turn = hulls[i, HULL_DRIVE_X], hulls[i, HULL_DRIVE_Y], hulls[i, HULL_DRIVE_YAW]
        if vx != 0.0 or vy != 0.0:
            yaw = hulls[i, HULL_TURNED] + turn * seconds / 2
            c, s = math.cos(yaw), math.sin(yaw)
            vx, vy = c * vx - s * vy, s * vx + c * vy
        controls[first], controls[first + 1], controls[first + 2] = vx, vy, turn


@kernel("void(float64[::1], float64, float64, float64, float64)")
def _trail(row: FloatArray, way: float, pull: float, settled: float, seconds: float) -> None:
    """Shift a gimbal's yaw by ``way``, then return to the middle: ``Axis.trail``."""
    low, high, top = row[GIMBAL_LOWEST], row[GIMBAL_HIGHEST], row[GIMBAL_TOP]
    position, rate = row[GIMBAL_YAW] + way, row[GIMBAL_RATE]
    if not low <= position <= high:
        position, rate = (low if position < low else high), 0.0
    wanted = -pull * position
    if abs(position) < settled and abs(rate) < pull * settled:
        row[GIMBAL_YAW] = row[GIMBAL_RATE] = 0.0
        return
    wanted = top if wanted > top else (-top if wanted < -top else wanted)
    step, more = row[GIMBAL_ACCELERATION] * seconds, wanted - rate
    rate += step if more > step else (-step if more < -step else more)
    position += rate * seconds
    if not low <= position <= high:
        position, rate = (low if position < low else high), 0.0
    row[GIMBAL_YAW], row[GIMBAL_RATE] = position, rate


@kernel("int64(float64[:,::1], float64[:,::1], float64, float64, float64, int64[::1])")
def follow(
    hulls: FloatArray, gimbals: FloatArray, pull: float, settled: float, seconds: float, others: IntArray
) -> int:
    """Turn the gimbals of level robots after their bodies, where nothing aims them."""
    count = 0
    for i in range(hulls.shape[0]):
        if gimbals[i, USE] == 0.0:
            continue
        if gimbals[i, USE] == ALONE or hulls[i, HULL_LEANS] != 0.0:
            others[count] = i
            count += 1
            continue
        turned = hulls[i, HULL_TURNED]
        turn = turned - gimbals[i, GIMBAL_TURNED]
        gimbals[i, GIMBAL_TURNED] = turned
        gimbals[i, GIMBAL_SINCE] += turn
        _trail(gimbals[i], -turn, pull, settled, seconds)
        hulls[i, HULL_GAZE_YAW] = gimbals[i, GIMBAL_YAW]
    return count


@kernel("int64(float64[:,::1], float64[::1], float64[::1], float64, float64, int64[::1])")
def see(
    hulls: FloatArray, positions: FloatArray, velocities: FloatArray, storey: float, lifted: float, others: IntArray
) -> int:
    """Read pose and motion of the hulls that stand on springs, clear of all that they have to look at."""
    count = 0
    for i in range(hulls.shape[0]):
        q, v = int(hulls[i, HULL_Q]), int(hulls[i, HULL_V])
        x, y, z = positions[q], positions[q + 1], positions[q + 2]
        usual = hulls[i, HULL_SPRUNG] != 0.0
        usual = usual and -storey <= z - hulls[i, HULL_COUNTED] <= storey
        usual = usual and abs(x - hulls[i, HULL_LOOKED_X]) + abs(y - hulls[i, HULL_LOOKED_Y]) <= hulls[i, HULL_FREE]
        if not (usual and -lifted <= z - hulls[i, HULL_REST] <= lifted):
            others[count] = i
            count += 1
            continue
        hulls[i, HULL_X], hulls[i, HULL_Y], hulls[i, HULL_Z], hulls[i, HULL_TURNED] = x, y, z, positions[q + 3]
        for k in range(4):
            hulls[i, HULL_BEFORE + k] = hulls[i, HULL_VX + k]
            hulls[i, HULL_VX + k] = velocities[v + k]
        torso = int(hulls[i, HULL_TORSO])
        if torso >= 0:
            hulls[i, HULL_BELLY] = positions[torso]
            hulls[i, HULL_VZ] += velocities[int(hulls[i, HULL_SINKING])]
    return count


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, int64[::1])")
def measure(
    hulls: FloatArray,
    imus: FloatArray,
    noises: FloatArray,
    stamp: float,
    seconds: float,
    gravity: float,
    others: IntArray,
) -> int:
    """Measure with the IMUs of level robots that have noise left."""
    count, drawn = 0, noises.shape[1]
    for i in range(hulls.shape[0]):
        if imus[i, USE] == 0.0:
            continue
        turned, at = hulls[i, HULL_TURNED], int(imus[i, IMU_AT])
        alone = imus[i, USE] == ALONE or hulls[i, HULL_LEANS] != 0.0 or imus[i, IMU_LEANT] != 0.0 or at >= drawn
        rate = yaw = 0.0
        if not alone:
            rate = (turned - imus[i, IMU_TURNED]) / seconds * imus[i, IMU_SCALE] + noises[i, at + 2]
            yaw = imus[i, IMU_YAW] + rate * seconds
            alone = not -math.pi < yaw <= math.pi
        if alone:
            others[count] = i
            count += 1
            continue
        imus[i, IMU_AT] = at + IMU_NOISES
        imus[i, IMU_RATE], imus[i, IMU_YAW], imus[i, IMU_TURNED] = rate, yaw, turned
        vx, vy, vz = hulls[i, HULL_VX], hulls[i, HULL_VY], hulls[i, HULL_VZ]
        ax, ay = (vx - imus[i, IMU_MX]) / seconds, (vy - imus[i, IMU_MY]) / seconds
        az = (vz - imus[i, IMU_MZ]) / seconds
        imus[i, IMU_MX], imus[i, IMU_MY], imus[i, IMU_MZ] = vx, vy, vz
        c, s = math.cos(turned), math.sin(turned)
        imus[i, IMU_FELT_X] = c * ax + s * ay + noises[i, at + 3]
        imus[i, IMU_FELT_Y] = c * ay - s * ax + noises[i, at + 4]
        imus[i, IMU_FELT_Z] = az + gravity + noises[i, at + 5]
        imus[i, IMU_STAMP] = stamp
        imus[i, IMU_RATES], imus[i, IMU_RATES + 1] = noises[i, at], noises[i, at + 1]
        imus[i, IMU_RATES + 2] = hulls[i, HULL_TURN] * imus[i, IMU_SCALE] + noises[i, at + 2]
    return count


@kernel("boolean(float64[:,::1], int64, float64, float64)")
def _slips(hulls: FloatArray, i: int, speed_square: float, turn_rate: float) -> bool:
    """Return whether a body's motion differs from that of its wheels."""
    vx, vy, turn = hulls[i, HULL_VX], hulls[i, HULL_VY], hulls[i, HULL_TURN]
    if not -turn_rate <= turn - hulls[i, HULL_WHEEL_YAW] <= turn_rate:
        return True
    c, s = math.cos(hulls[i, HULL_TURNED]), math.sin(hulls[i, HULL_TURNED])
    off_x = c * vx + s * vy - hulls[i, HULL_WHEEL_X]
    off_y = c * vy - s * vx - hulls[i, HULL_WHEEL_Y]
    return bool(off_x * off_x + off_y * off_y > speed_square)


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, float64, int64[::1])")
def watch(
    hulls: FloatArray,
    imus: FloatArray,
    statuses: FloatArray,
    stamp: float,
    gravity: float,
    speed_square: float,
    turn_rate: float,
    others: IntArray,
) -> int:
    """Watch for blows and slip of robots whose wheels turn as their motors."""
    count = 0
    for i in range(hulls.shape[0]):
        if statuses[i, USE] == 0.0:
            continue
        if statuses[i, USE] == ALONE or hulls[i, HULL_SLACK] != 0.0:
            others[count] = i
            count += 1
            continue
        blow = statuses[i, STATUS_BLOW]
        statuses[i, STATUS_STAMP] = stamp
        if not -blow <= imus[i, IMU_FELT_X] <= blow:
            statuses[i, STATUS_BLOWS] = stamp
        if not -blow <= imus[i, IMU_FELT_Y] <= blow:
            statuses[i, STATUS_BLOWS + 1] = stamp
        if abs(abs(imus[i, IMU_FELT_Z]) - gravity) > blow:
            statuses[i, STATUS_BLOWS + 2] = stamp
        vx, vy = hulls[i, HULL_VX], hulls[i, HULL_VY]
        turns = hulls[i, HULL_WHEEL_X] != 0.0 or hulls[i, HULL_WHEEL_Y] != 0.0 or hulls[i, HULL_WHEEL_YAW] != 0.0
        moves = turns or vx * vx + vy * vy > speed_square
        slips = moves and _slips(hulls, i, speed_square, turn_rate)
        statuses[i, STATUS_SLIPPING] = statuses[i, STATUS_SLIPPING] + 1.0 if slips else 0.0
    return count


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, int64[::1])")
def dead_reckon(
    hulls: FloatArray,
    imus: FloatArray,
    odometries: FloatArray,
    noises: FloatArray,
    stamp: float,
    seconds: float,
    others: IntArray,
) -> int:
    """Add a tick to the odometry of robots that stand, or drive and have noise left."""
    count, drawn = 0, noises.shape[1]
    for i in range(hulls.shape[0]):
        row = odometries[i]
        if row[USE] == 0.0:
            continue
        wheel_x, wheel_y, rate = hulls[i, HULL_WHEEL_X], hulls[i, HULL_WHEEL_Y], imus[i, IMU_RATE]
        drives = wheel_x != 0.0 or wheel_y != 0.0
        if not drives and hulls[i, HULL_WHEEL_YAW] == 0.0 and abs(rate) < row[ODOMETRY_STILL]:
            rate = 0.0
        at, yaw = int(row[ODOMETRY_AT]), row[ODOMETRY_STATE + 3]
        turned = yaw + rate * seconds if rate != 0.0 else yaw
        usual = row[USE] == TOGETHER and hulls[i, HULL_SLACK] == 0.0
        if not (usual and (not drives or at < drawn) and -math.pi < turned <= math.pi):
            others[count] = i
            count += 1
            continue
        vx = vy = 0.0
        if drives:
            vx = wheel_x * (row[ODOMETRY_SCALE_X] + row[ODOMETRY_NOISE] * noises[i, at])
            vy = wheel_y * (row[ODOMETRY_SCALE_Y] + row[ODOMETRY_NOISE] * noises[i, at + 1])
            row[ODOMETRY_AT] = at + ODOMETRY_NOISES
            middle = yaw + rate * seconds / 2
            c, s = math.cos(middle), math.sin(middle)
            row[ODOMETRY_STATE + 1] += (c * vx - s * vy) * seconds
            row[ODOMETRY_STATE + 2] += (s * vx + c * vy) * seconds
            row[ODOMETRY_STATE + 7] += math.sqrt(vx * vx + vy * vy) * seconds
        row[ODOMETRY_STATE], row[ODOMETRY_STATE + 3] = stamp, turned
        row[ODOMETRY_STATE + 4], row[ODOMETRY_STATE + 5], row[ODOMETRY_STATE + 6] = vx, vy, rate
    return count


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], int64[::1])")
def touch(hulls: FloatArray, contacts: FloatArray, docks: FloatArray, others: IntArray) -> int:
    """List the robots whose rear has come to a dock or left it."""
    count = 0
    for i in range(hulls.shape[0]):
        if contacts[i, USE] == 0.0:
            continue
        near, made = contacts[i, CONTACT_DISTANCE], False
        for dock in range(docks.shape[0]):
            if docks[dock, 5] != hulls[i, HULL_FLOOR]:
                continue
            dx, dy, c, s = (
                hulls[i, HULL_X] - docks[dock, 0],
                hulls[i, HULL_Y] - docks[dock, 1],
                docks[dock, 2],
                docks[dock, 3],
            )
            if abs(c * dx + s * dy - hulls[i, HULL_RADIUS]) > near or abs(c * dy - s * dx) > near:
                continue
            turn = hulls[i, HULL_TURNED] - docks[dock, 4]
            turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
            made = made or abs(turn) <= contacts[i, CONTACT_ANGLE]
        if made != (contacts[i, CONTACT_MADE] != 0.0):
            others[count] = i
            count += 1
    return count
