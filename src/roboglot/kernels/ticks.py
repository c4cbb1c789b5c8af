"""Several ticks of a world in one call: people, wheels, motion and what all robots sense in every tick.

Each stage is a kernel of its own, here (the steps of people) or elsewhere; ``run`` calls them in the world's order, and
stops in the first tick in which one of them leaves something to others. Columns and stages are those of ``layouts``.
"""

from __future__ import annotations

import math

from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.kernels.batch import (
    all_below,
    dead_reckon,
    drive_wheels,
    find_docks,
    measure_imus,
    read_motion,
    turn_gimbals,
    watch_motion,
)
from roboglot.kernels.compiled import kernel
from roboglot.kernels.free_motion import advance, clear
from roboglot.kernels.layouts import (
    ACTS,
    COUNT_UNIT,
    DONE,
    GIMBALS,
    HULL_FLOOR,
    HULL_TILTED,
    HULL_X,
    HULL_Y,
    MEASURED,
    NEAR,
    PEOPLE,
    PERSON_BODY,
    PERSON_DISTANCE,
    PERSON_FLOOR,
    PERSON_GOAL_X,
    PERSON_GOAL_Y,
    PERSON_IDLE,
    PERSON_SPEED,
    PERSON_STATE,
    PERSON_WAITED,
    PERSON_WALKED,
    PERSON_X,
    PERSON_Y,
    PERSON_YAW,
    RECKONED,
    SEEN,
    SETTLING,
    SINGLE,
    STAGE_UNIT,
    STANDS,
    STUCK,
    TICKS_UNIT,
    TOUCHED,
    USE,
    WAITS,
    WATCHED,
)

LINES, TABLES = "UniTuple(float64[::1], {})", "UniTuple(float64[:,::1], {})"


@kernel("boolean(float64[::1], float64[:,::1], float64, float64, float64, float64, float64)")
def _hindered(
    person: FloatArray, hulls: FloatArray, c: float, s: float, manners: float, side: float, near: float
) -> bool:
    """Return whether a robot is right in front of a person who walks in the direction of cosine and sine."""
    for i in range(hulls.shape[0]):
        if hulls[i, HULL_FLOOR] != person[PERSON_FLOOR]:
            continue
        x, y = hulls[i, HULL_X] - person[PERSON_X], hulls[i, HULL_Y] - person[PERSON_Y]
        if -near < x < near and -near < y < near and 0.0 < c * x + s * y < manners and abs(c * y - s * x) < side:
            return True
    return False


@kernel(
    "int64(float64[:,::1], float64[:,::1], float64[:,::1], float64[:,::1], int64, float64, float64, float64, float64)"
)
def walk(
    people: FloatArray,
    hulls: FloatArray,
    places: FloatArray,
    turns: FloatArray,
    first: int,
    seconds: float,
    manners: float,
    side: float,
    near: float,
) -> int:
    """Let ``seconds`` pass for people from ``first`` on; return the first who needs more than this, or their number.

    Twin of what ``Walker`` does with those who walk straight on or wait.

    ``places`` and ``turns`` are the physics', of all movable bodies; the last three: see ``simulation/people``.
    """
    for i in range(first, people.shape[0]):
        person = people[i]
        state = person[PERSON_STATE]
        if state == ACTS:
            return i
        if state == STANDS:
            person[PERSON_WALKED] = 0.0
            continue
        if state == WAITS:
            if person[PERSON_IDLE] == 0.0:
                return i
            person[PERSON_WALKED] = 0.0
            person[PERSON_IDLE] -= 1.0
            continue
        x, y, step = person[PERSON_X], person[PERSON_Y], person[PERSON_SPEED] * seconds
        dx, dy = person[PERSON_GOAL_X] - x, person[PERSON_GOAL_Y] - y
        if math.sqrt(dx * dx + dy * dy) <= step:
            return i  # arrives
        heading = math.atan2(dy, dx)
        c, s = math.cos(heading), math.sin(heading)
        if _hindered(person, hulls, c, s, manners, side, near):
            return i
        person[PERSON_WALKED], person[PERSON_WAITED] = 1.0, 0.0
        person[PERSON_DISTANCE] += step
        person[PERSON_X], person[PERSON_Y] = x + step * c, y + step * s
        body = int(person[PERSON_BODY])
        places[body, 0], places[body, 1] = person[PERSON_X], person[PERSON_Y]
        if heading != person[PERSON_YAW]:
            person[PERSON_YAW] = heading
            turns[body, 0], turns[body, 3] = math.cos(heading / 2), math.sin(heading / 2)
    return int(people.shape[0])


@kernel("boolean(float64[:,::1], float64[:,::1])")
def _all_follow(hulls: FloatArray, gimbals: FloatArray) -> bool:
    """Return whether every gimbal only turns after its body."""
    for i in range(hulls.shape[0]):
        if gimbals[i, USE] == SINGLE or (gimbals[i, USE] != 0.0 and hulls[i, HULL_TILTED] != 0.0):
            return False
    return True


@kernel("boolean(float64[::1], float64[::1])")
def _same(one: FloatArray, other: FloatArray) -> bool:
    for i in range(one.shape[0]):  # noqa: SIM110 - a kernel
        if one[i] != other[i]:
            return False
    return True


@kernel(f"boolean({LINES.format(6)}, {LINES.format(6)})")
def _all_same(ones: tuple[FloatArray, ...], others: tuple[FloatArray, ...]) -> bool:
    """Return whether each array equals its fellow; the first, which changes most often, is compared first."""
    for k in range(len(ones)):  # noqa: SIM110
        if not _same(ones[k], others[k]):
            return False
    return True


@kernel(
    f"int64(float64[:,::1], {LINES.format(9)}, {TABLES.format(5)}, UniTuple(float64, 18), int64, boolean, int64[::1])"
)
def _move(
    hulls: FloatArray,
    state: tuple[FloatArray, ...],
    servos: tuple[FloatArray, ...],
    settings: tuple[float, ...],
    steps: int,
    free: bool,
    others: IntArray,
) -> int:
    """Move robots that nothing can touch; return the stage that is left, and its count."""
    positions, velocities, controls, accelerations, forces, masses, slack, stiffness, damping = state
    uprights, ranges, gains, biases, limits = servos
    _, _, step, rests, storey, lifted, _, _, weight = settings[:9]
    if not free or not advance(
        hulls, uprights, positions, velocities, controls, accelerations, forces, masses, ranges, slack,
        stiffness, damping, gains, biases, limits, weight, step, steps,
    ):  # fmt: skip
        return STUCK * STAGE_UNIT
    if all_below(velocities, rests):
        return SETTLING * STAGE_UNIT
    count = read_motion(hulls, positions, velocities, storey, lifted, others)
    return int(count * COUNT_UNIT + SEEN * STAGE_UNIT if count else DONE)


@kernel(f"int64({TABLES.format(9)}, UniTuple(float64, 18), float64, int64[::1])")
def _sense(robots: tuple[FloatArray, ...], settings: tuple[float, ...], stamp: float, others: IntArray) -> int:
    """Sense with all parts that are sensed together; return the same."""
    hulls, _, contacts, docks, imus, shakes, statuses, odometries, slips = robots
    seconds, gravity, blow_gravity, speed_square, turn_rate = settings[1], *settings[14:]
    stage, count = TOUCHED, find_docks(hulls, contacts, docks, others)
    if not count:
        stage, count = MEASURED, measure_imus(hulls, imus, shakes, stamp, seconds, gravity, others)
    if not count:
        stage, count = (
            WATCHED,
            watch_motion(hulls, imus, statuses, stamp, blow_gravity, speed_square, turn_rate, others),
        )
    if not count:
        stage, count = RECKONED, dead_reckon(hulls, imus, odometries, slips, stamp, seconds, others)
    return int(count * COUNT_UNIT + stage * STAGE_UNIT if count else DONE)


@kernel(
    f"int64({TABLES.format(9)}, {TABLES.format(5)}, int64[::1], {LINES.format(9)}, {TABLES.format(5)},"
    f" {LINES.format(6)}, {LINES.format(6)}, UniTuple(float64, 18), int64, int64, int64, boolean, boolean, boolean,"
    " boolean, int64[::1])"
)
def run(
    robots: tuple[FloatArray, ...],
    scene: tuple[FloatArray, ...],
    geoms: IntArray,
    state: tuple[FloatArray, ...],
    servos: tuple[FloatArray, ...],
    now: tuple[FloatArray, ...],
    kept: tuple[FloatArray, ...],
    settings: tuple[float, ...],
    steps: int,
    number: int,
    ticks: int,
    followed: bool,
    known: bool,
    asleep: bool,
    free: bool,
    others: IntArray,
) -> int:
    """Do up to ``ticks`` ticks after tick ``number``; return the ticks, the stage that is left, and who is.

    ``followed``: the gimbals have had their turn in the first; ``known``: see ``free_motion.clear``, for the first;
    ``asleep``: while ``now`` is as ``kept``, nothing moves; ``free``: no contact is left from the last step. The
    answer: ticks * TICKS_UNIT + count * COUNT_UNIT + stage * STAGE_UNIT + moved. A tick that is not ended counts, but
    one that waits for its gimbals.
    """
    hulls, gimbals = robots[0], robots[1]
    people, walls, places, turns, sizes = scene
    origin, seconds, lowest, margin = settings[0], settings[1], settings[6], settings[7]
    manners, side, near, pull, settled = settings[9:14]
    moved, left, tick = 0, DONE, 0
    while tick < ticks and not left:
        if tick > 0 or not followed:
            if not _all_follow(hulls, gimbals):
                left = 0 if tick > 0 else GIMBALS * STAGE_UNIT
                break
            turn_gimbals(hulls, gimbals, pull, settled, seconds, others)
        tick += 1
        drive_wheels(hulls, state[2], seconds)
        person = walk(people, hulls, places, turns, 0, seconds, manners, side, near)
        if person < people.shape[0]:
            left = person * COUNT_UNIT + PEOPLE * STAGE_UNIT
        elif not clear(hulls, walls, places, turns, sizes, geoms, lowest, margin, seconds, known or tick > 1):
            left = NEAR * STAGE_UNIT
        elif not (asleep and _all_same(now, kept)):
            asleep = False
            left = _move(hulls, state, servos, settings, steps, free, others)
            moved = 1 if left == DONE or left % COUNT_UNIT == SEEN * STAGE_UNIT else moved
        if not left:
            left = _sense(robots, settings, origin + (number + tick) * seconds, others)
    return int(tick * TICKS_UNIT + left + moved)
