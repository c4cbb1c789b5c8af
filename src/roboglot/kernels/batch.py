"""One tick for all robots of a world at once: compiled twins of functions of the simulated parts.

They compute the same numbers as their twins, to the last bit: every operation is in the same order. A robot in an
unusual state is left alone: its row is listed in ``others``, for the twin, and the kernel returns how many are listed.
Columns are those of ``layouts``.
"""

from __future__ import annotations

import math

from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.kernels.compiled import kernel
from roboglot.kernels.layouts import (
    BATCHED,
    CONTACT_ANGLE,
    CONTACT_DISTANCE,
    CONTACT_MADE,
    GIMBAL_ACCELERATION,
    GIMBAL_HIGHEST,
    GIMBAL_HULL_TURNS,
    GIMBAL_HULL_YAW,
    GIMBAL_LOWEST,
    GIMBAL_RATE,
    GIMBAL_SPEED_MAX,
    GIMBAL_YAW,
    HULL_A,
    HULL_ANGULAR_STEP,
    HULL_DRIVE_X,
    HULL_DRIVE_Y,
    HULL_DRIVE_YAW,
    HULL_FLOOR,
    HULL_FLOOR_CHECK_Z,
    HULL_GIMBAL_YAW,
    HULL_GOAL_X,
    HULL_GOAL_Y,
    HULL_GOAL_YAW,
    HULL_HELD,
    HULL_LAST_V,
    HULL_LINEAR_STEP,
    HULL_LOOKUP_RANGE,
    HULL_LOOKUP_X,
    HULL_LOOKUP_Y,
    HULL_ON_SPRING,
    HULL_Q,
    HULL_RADIUS,
    HULL_REST_Z,
    HULL_TILTED,
    HULL_TORSO,
    HULL_TORSO_V,
    HULL_UNDERSIDE,
    HULL_UNDRIVEN,
    HULL_V,
    HULL_VX,
    HULL_VY,
    HULL_VZ,
    HULL_WHEEL_X,
    HULL_WHEEL_Y,
    HULL_WHEEL_YAW,
    HULL_X,
    HULL_Y,
    HULL_YAW,
    HULL_YAW_RATE,
    HULL_Z,
    IMU_AX,
    IMU_AY,
    IMU_AZ,
    IMU_HULL_VX,
    IMU_HULL_VY,
    IMU_HULL_VZ,
    IMU_HULL_YAW,
    IMU_NEXT_NOISE,
    IMU_NOISES,
    IMU_RATE,
    IMU_RATES,
    IMU_SCALE,
    IMU_STAMP,
    IMU_TILTED,
    IMU_YAW,
    ODOMETRY_NEXT_NOISE,
    ODOMETRY_NOISE,
    ODOMETRY_NOISES,
    ODOMETRY_SCALE_X,
    ODOMETRY_SCALE_Y,
    ODOMETRY_STATE,
    ODOMETRY_STILL,
    SINGLE,
    STATUS_IMPACT_MIN,
    STATUS_IMPACTS,
    STATUS_SLIPPING,
    STATUS_STAMP,
    USE,
)


@kernel("boolean(float64[::1], float64)")
def all_below(numbers: FloatArray, limit: float) -> bool:
    """Return whether all ``numbers`` are within ``limit`` of 0; False if there are none."""
    for number in numbers:
        if not -limit <= number <= limit:
            return False
    return len(numbers) > 0


@kernel("void(float64[::1])")
def _approach(row: FloatArray) -> None:
    """Bring the wheels' velocity a step nearer to its goal, as ``SimulatedBase`` does."""
    dx, dy = row[HULL_GOAL_X] - row[HULL_WHEEL_X], row[HULL_GOAL_Y] - row[HULL_WHEEL_Y]
    dyaw, linear, angular = row[HULL_GOAL_YAW] - row[HULL_WHEEL_YAW], row[HULL_LINEAR_STEP], row[HULL_ANGULAR_STEP]
    way = math.sqrt(dx * dx + dy * dy)
    if way <= linear and abs(dyaw) <= angular:
        for k in range(3):
            row[HULL_WHEEL_X + k] = row[HULL_GOAL_X + k]
        row[HULL_LINEAR_STEP] = row[HULL_ANGULAR_STEP] = 0.0
    else:
        part = min(1.0, linear / way) if way > 0.0 else 1.0
        row[HULL_WHEEL_X] += dx * part
        row[HULL_WHEEL_Y] += dy * part
        row[HULL_WHEEL_YAW] += max(-angular, min(angular, dyaw))
    for k in range(3):
        row[HULL_DRIVE_X + k] = row[HULL_WHEEL_X + k]


@kernel("void(float64[:,::1], float64[::1], float64)")
def drive_wheels(hulls: FloatArray, controls: FloatArray, seconds: float) -> None:
    """Turn the wheels of all hulls as commanded: write the physics' ``controls`` for the next ``seconds``."""
    for i in range(hulls.shape[0]):
        if hulls[i, HULL_LINEAR_STEP] > 0.0:
            _approach(hulls[i])
        first = int(hulls[i, HULL_A])
        if hulls[i, HULL_HELD] != 0.0:
            controls[first] = controls[first + 1] = controls[first + 2] = 0.0
            continue
        vx, vy, turn = hulls[i, HULL_DRIVE_X], hulls[i, HULL_DRIVE_Y], hulls[i, HULL_DRIVE_YAW]
        if vx != 0.0 or vy != 0.0:
            yaw = hulls[i, HULL_YAW] + turn * seconds / 2
            c, s = math.cos(yaw), math.sin(yaw)
            vx, vy = c * vx - s * vy, s * vx + c * vy
        controls[first], controls[first + 1], controls[first + 2] = vx, vy, turn


@kernel("void(float64[::1], float64, float64, float64, float64)")
def _trail_yaw(row: FloatArray, way: float, pull: float, settled: float, seconds: float) -> None:
    """Shift a gimbal's yaw by ``way``, then return to the middle: ``Axis.trail``."""
    low, high, top = row[GIMBAL_LOWEST], row[GIMBAL_HIGHEST], row[GIMBAL_SPEED_MAX]
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
def turn_gimbals(
    hulls: FloatArray, gimbals: FloatArray, pull: float, settled: float, seconds: float, others: IntArray
) -> int:
    """Turn the gimbals of level robots after their bodies, unless they have an aim."""
    count = 0
    for i in range(hulls.shape[0]):
        if gimbals[i, USE] == 0.0:
            continue
        if gimbals[i, USE] == SINGLE or hulls[i, HULL_TILTED] != 0.0:
            others[count] = i
            count += 1
            continue
        turned = hulls[i, HULL_YAW]
        turn = turned - gimbals[i, GIMBAL_HULL_YAW]
        gimbals[i, GIMBAL_HULL_YAW] = turned
        gimbals[i, GIMBAL_HULL_TURNS] += turn
        _trail_yaw(gimbals[i], -turn, pull, settled, seconds)
        hulls[i, HULL_GIMBAL_YAW] = gimbals[i, GIMBAL_YAW]
    return count


@kernel("int64(float64[:,::1], float64[::1], float64[::1], float64, float64, int64[::1])")
def read_motion(
    hulls: FloatArray, positions: FloatArray, velocities: FloatArray, storey: float, lifted: float, others: IntArray
) -> int:
    """Read pose and motion of the hulls on springs, as long as they are within range of their last search for walls."""
    count = 0
    for i in range(hulls.shape[0]):
        q, v = int(hulls[i, HULL_Q]), int(hulls[i, HULL_V])
        x, y, z = positions[q], positions[q + 1], positions[q + 2]
        usual = hulls[i, HULL_ON_SPRING] != 0.0
        usual = usual and -storey <= z - hulls[i, HULL_FLOOR_CHECK_Z] <= storey
        usual = (
            usual and abs(x - hulls[i, HULL_LOOKUP_X]) + abs(y - hulls[i, HULL_LOOKUP_Y]) <= hulls[i, HULL_LOOKUP_RANGE]
        )
        if not (usual and -lifted <= z - hulls[i, HULL_REST_Z] <= lifted):
            others[count] = i
            count += 1
            continue
        hulls[i, HULL_X], hulls[i, HULL_Y], hulls[i, HULL_Z], hulls[i, HULL_YAW] = x, y, z, positions[q + 3]
        for k in range(4):
            hulls[i, HULL_LAST_V + k] = hulls[i, HULL_VX + k]
            hulls[i, HULL_VX + k] = velocities[v + k]
        torso = int(hulls[i, HULL_TORSO])
        if torso >= 0:
            hulls[i, HULL_UNDERSIDE] = positions[torso]
            hulls[i, HULL_VZ] += velocities[int(hulls[i, HULL_TORSO_V])]
    return count


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, int64[::1])")
def measure_imus(
    hulls: FloatArray,
    imus: FloatArray,
    noises: FloatArray,
    stamp: float,
    seconds: float,
    gravity: float,
    others: IntArray,
) -> int:
    """Measure with the IMUs of robots that are level and have noise left in ``noises``."""
    count, drawn = 0, noises.shape[1]
    for i in range(hulls.shape[0]):
        if imus[i, USE] == 0.0:
            continue
        turned, at = hulls[i, HULL_YAW], int(imus[i, IMU_NEXT_NOISE])
        alone = imus[i, USE] == SINGLE or hulls[i, HULL_TILTED] != 0.0 or imus[i, IMU_TILTED] != 0.0 or at >= drawn
        rate = yaw = 0.0
        if not alone:
            rate = (turned - imus[i, IMU_HULL_YAW]) / seconds * imus[i, IMU_SCALE] + noises[i, at + 2]
            yaw = imus[i, IMU_YAW] + rate * seconds
            alone = not -math.pi < yaw <= math.pi
        if alone:
            others[count] = i
            count += 1
            continue
        imus[i, IMU_NEXT_NOISE] = at + IMU_NOISES
        imus[i, IMU_RATE], imus[i, IMU_YAW], imus[i, IMU_HULL_YAW] = rate, yaw, turned
        vx, vy, vz = hulls[i, HULL_VX], hulls[i, HULL_VY], hulls[i, HULL_VZ]
        ax, ay = (vx - imus[i, IMU_HULL_VX]) / seconds, (vy - imus[i, IMU_HULL_VY]) / seconds
        az = (vz - imus[i, IMU_HULL_VZ]) / seconds
        imus[i, IMU_HULL_VX], imus[i, IMU_HULL_VY], imus[i, IMU_HULL_VZ] = vx, vy, vz
        c, s = math.cos(turned), math.sin(turned)
        imus[i, IMU_AX] = c * ax + s * ay + noises[i, at + 3]
        imus[i, IMU_AY] = c * ay - s * ax + noises[i, at + 4]
        imus[i, IMU_AZ] = az + gravity + noises[i, at + 5]
        imus[i, IMU_STAMP] = stamp
        imus[i, IMU_RATES], imus[i, IMU_RATES + 1] = noises[i, at], noises[i, at + 1]
        imus[i, IMU_RATES + 2] = hulls[i, HULL_YAW_RATE] * imus[i, IMU_SCALE] + noises[i, at + 2]
    return count


@kernel("boolean(float64[:,::1], int64, float64, float64)")
def _slips(hulls: FloatArray, i: int, speed_square: float, turn_rate: float) -> bool:
    """Return whether a body's motion differs from that of its wheels."""
    vx, vy, turn = hulls[i, HULL_VX], hulls[i, HULL_VY], hulls[i, HULL_YAW_RATE]
    if not -turn_rate <= turn - hulls[i, HULL_WHEEL_YAW] <= turn_rate:
        return True
    c, s = math.cos(hulls[i, HULL_YAW]), math.sin(hulls[i, HULL_YAW])
    off_x = c * vx + s * vy - hulls[i, HULL_WHEEL_X]
    off_y = c * vy - s * vx - hulls[i, HULL_WHEEL_Y]
    return bool(off_x * off_x + off_y * off_y > speed_square)


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], float64, float64, float64, float64, int64[::1])")
def watch_motion(
    hulls: FloatArray,
    imus: FloatArray,
    statuses: FloatArray,
    stamp: float,
    gravity: float,
    speed_square: float,
    turn_rate: float,
    others: IntArray,
) -> int:
    """Watch for impacts and slip of robots whose wheels are all driven."""
    count = 0
    for i in range(hulls.shape[0]):
        if statuses[i, USE] == 0.0:
            continue
        if statuses[i, USE] == SINGLE or hulls[i, HULL_UNDRIVEN] != 0.0:
            others[count] = i
            count += 1
            continue
        blow = statuses[i, STATUS_IMPACT_MIN]
        statuses[i, STATUS_STAMP] = stamp
        if not -blow <= imus[i, IMU_AX] <= blow:
            statuses[i, STATUS_IMPACTS] = stamp
        if not -blow <= imus[i, IMU_AY] <= blow:
            statuses[i, STATUS_IMPACTS + 1] = stamp
        if abs(abs(imus[i, IMU_AZ]) - gravity) > blow:
            statuses[i, STATUS_IMPACTS + 2] = stamp
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
    """Add a tick to the odometry of robots that stand, or that drive and have noise left in ``noises``."""
    count, drawn = 0, noises.shape[1]
    for i in range(hulls.shape[0]):
        row = odometries[i]
        if row[USE] == 0.0:
            continue
        wheel_x, wheel_y, rate = hulls[i, HULL_WHEEL_X], hulls[i, HULL_WHEEL_Y], imus[i, IMU_RATE]
        drives = wheel_x != 0.0 or wheel_y != 0.0
        if not drives and hulls[i, HULL_WHEEL_YAW] == 0.0 and abs(rate) < row[ODOMETRY_STILL]:
            rate = 0.0
        at, yaw = int(row[ODOMETRY_NEXT_NOISE]), row[ODOMETRY_STATE + 3]
        turned = yaw + rate * seconds if rate != 0.0 else yaw
        usual = row[USE] == BATCHED and hulls[i, HULL_UNDRIVEN] == 0.0
        if not (usual and (not drives or at < drawn) and -math.pi < turned <= math.pi):
            others[count] = i
            count += 1
            continue
        vx = vy = 0.0
        if drives:
            vx = wheel_x * (row[ODOMETRY_SCALE_X] + row[ODOMETRY_NOISE] * noises[i, at])
            vy = wheel_y * (row[ODOMETRY_SCALE_Y] + row[ODOMETRY_NOISE] * noises[i, at + 1])
            row[ODOMETRY_NEXT_NOISE] = at + ODOMETRY_NOISES
            middle = yaw + rate * seconds / 2
            c, s = math.cos(middle), math.sin(middle)
            row[ODOMETRY_STATE + 1] += (c * vx - s * vy) * seconds
            row[ODOMETRY_STATE + 2] += (s * vx + c * vy) * seconds
            row[ODOMETRY_STATE + 7] += math.sqrt(vx * vx + vy * vy) * seconds
        row[ODOMETRY_STATE], row[ODOMETRY_STATE + 3] = stamp, turned
        row[ODOMETRY_STATE + 4], row[ODOMETRY_STATE + 5], row[ODOMETRY_STATE + 6] = vx, vy, rate
    return count


@kernel("int64(float64[:,::1], float64[:,::1], float64[:,::1], int64[::1])")
def find_docks(hulls: FloatArray, contacts: FloatArray, docks: FloatArray, others: IntArray) -> int:
    """List the robots whose rear contacts have come to a dock or left it."""
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
            turn = hulls[i, HULL_YAW] - docks[dock, 4]
            turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
            made = made or abs(turn) <= contacts[i, CONTACT_ANGLE]
        if made != (contacts[i, CONTACT_MADE] != 0.0):
            others[count] = i
            count += 1
    return count
