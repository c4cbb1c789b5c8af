"""cyberdog.motion.run_sequence: a choreography written by the program, pace by pace (4.4.04).

A program's values are hostile: types, counts and times are checked here, ranges by the robot's legs.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from roboglot.model.components.motion.feet import TROT, Foot, Footfall, Foothold
from roboglot.model.components.motion.gaits import FOOT_LIFT_MIN
from roboglot.model.components.motion.legs import STEPS_MAX, BodyPose, Legs, Step
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import STILL, Orientation, Point, Twist
from roboglot.programs.functions.moving.attitudes import held
from roboglot.programs.functions.moving.limits import outside
from roboglot.programs.functions.moving.outcomes import report_outcome
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record
from roboglot.values import dataclass

SEQUENCE = 400  # MotionId
GAIT_UNIT = 0.03  # s: the robot's unit for a gait's duration, contrary to the manual
NAME_MAX = 128  # characters
LANDING_GAIN_MAX = 1.5  # the manual states 1; its own examples use 1.5
FEET = {
    Foot.RIGHT_FRONT: "right_forefoot",
    Foot.LEFT_FRONT: "left_forefoot",
    Foot.RIGHT_REAR: "right_hindfoot",
    Foot.LEFT_REAR: "left_hindfoot",
}


@ABILITIES.on("cyberdog.motion.run_sequence", needs=(Legs,))
async def run_sequence(session: Session, sequence: object) -> Record:
    """Step by the gait list and move by the pace list, then stand straight; a pace's duration is in ms.

    The gaits, in units of 30 ms, begin again as long as there are paces; without any it trots. Feet on the floor stay
    where they are, and hold the body back when a leg is stretched to its end. A foot's x and y are m beside its place
    below the hip, w how high it is lifted. A pace's twist has m/s and, as linear.z, degrees/s; its centroid has m from
    how the robot stands, and degrees. An axis whose weight is 0 while others have some keeps what it had.
    """
    if not isinstance(sequence, Record) or sequence.type != "MotionSequence":
        raise TypeError("run_sequence() takes a MotionSequence")
    wrong = ""
    try:
        footfalls = _footfalls(sequence)
        paces = [_pace(pace) for pace in _list(sequence, "pace_list", "MotionSequencePace")]
    except InvalidGoal as error:
        wrong, paces, footfalls = str(error), [], TROT

    async def do() -> None:
        legs = session.robot[Legs]
        await session.complete(legs.dance(_steps(paces, legs), footfalls, source=session.source))

    outcome, response = await report_outcome(session, SEQUENCE, wrong, do())
    body = {"result": response["result"], "code": response["code"], "describe": outcome.fields["describe"]}
    fields = {"state": outcome, "response": Record("MotionSequenceServiceResponseBody", body)}
    return Record("MotionSequenceServiceResponse", fields)


def _footfalls(sequence: Record) -> Sequence[Footfall]:
    """Return the gait list. Raises InvalidGoal for a sequence without a name or paces, or with invalid gaits."""
    name = sequence.fields.get("name")
    if not isinstance(name, str) or not name.isidentifier() or len(name) > NAME_MAX:
        raise InvalidGoal("a sequence's name must be a valid name of a variable")
    if not _list(sequence, "pace_list", "MotionSequencePace"):
        raise InvalidGoal("a sequence needs paces")
    return [_footfall(gait) for gait in _list(sequence, "gait_list", "MotionSequenceGait")] or TROT


def _footfall(gait: Record) -> Footfall:
    seconds = _number(gait, "duration") * GAIT_UNIT
    if seconds <= 0:
        raise InvalidGoal("a gait needs a duration above 0")
    down = {foot: _number(gait, name) for foot, name in FEET.items()}
    if any(number not in (0, 1) for number in down.values()):
        raise InvalidGoal("a foot must be 1 (on the ground) or 0")
    return Footfall(seconds, frozenset(foot for foot, number in down.items() if number))


@dataclass(frozen=True, slots=True)
class _Pace:
    """Step with the height as an offset, m, and flags of the axes that it changes (x y z roll pitch yaw)."""

    step: Step
    followed: tuple[bool, ...]


def _pace(pace: Record) -> _Pace:
    weights = [_number(pace, "weight", part, axis) for part in ("linear", "angular") for axis in "xyz"]
    if any(weight < 0.0 for weight in weights):
        raise InvalidGoal("a weight must not be negative")
    landing, friction = _number(pace, "landing_gain"), _number(pace, "friction_coefficient")
    if not 0.0 <= landing <= LANDING_GAIN_MAX:
        raise InvalidGoal(f"landing_gain is 0 to {LANDING_GAIN_MAX}")
    if not 0.1 <= friction <= 1.0:
        raise InvalidGoal("friction_coefficient is 0.1 to 1")
    _number(pace, "use_mpc_track")
    x, y, yaw = (_number(pace, "twist", "linear", axis) for axis in "xyz")
    shift_x, shift_y, height = (_number(pace, "centroid", "position", axis) for axis in "xyz")
    angles = [_number(pace, "centroid", "orientation", axis) for axis in "xyz"]
    held_so = dict(zip(("relative_roll", "relative_pitch", "relative_yaw"), angles, strict=True))
    shifted = {"centroid_x": shift_x, "centroid_y": shift_y, "relative_centroid_z": height}
    if words := outside(x_velocity=x, y_velocity=y, z_velocity=yaw, **shifted, **held_so):
        raise InvalidGoal(words)
    body = BodyPose(height, Orientation(*map(math.radians, angles)), Point(shift_x, shift_y))
    seconds, twist = _number(pace, "duration") / 1000.0, Twist(x, y, math.radians(yaw))
    step = Step(seconds, twist, body, footholds=_footholds(pace), friction=friction, landing=landing)
    return _Pace(step, tuple(weight > 0.0 or not any(weights) for weight in weights))


def _footholds(pace: Record) -> tuple[Foothold, ...]:
    """Return the feet's places, m; a lifted foot rises by FOOT_LIFT_MIN at least."""
    numbers = ([_number(pace, name, axis) for axis in "xyzw"] for name in FEET.values())
    return tuple(Foothold(x, y, z, FOOT_LIFT_MIN if 0.0 <= lift < FOOT_LIFT_MIN else lift) for x, y, z, lift in numbers)


def _steps(paces: Sequence[_Pace], legs: Legs) -> list[Step]:
    """Return steps with heights above the floor, offset from the current stand, clamped to the legs' limits."""
    stood, twist, body, steps = legs.body_height, STILL, BodyPose(0.0), []
    for pace in paces:
        x, y, z, roll, pitch, yaw = pace.followed
        to, was, now = pace.step.twist, body, pace.step.body
        twist = Twist(to.x if x else twist.x, to.y if y else twist.y, to.yaw if yaw else twist.yaw)
        turned = Orientation(
            now.attitude.roll if roll else was.attitude.roll,
            now.attitude.pitch if pitch else was.attitude.pitch,
            now.attitude.yaw if yaw else was.attitude.yaw,
        )
        shift = Point(now.shift.x if x else was.shift.x, now.shift.y if y else was.shift.y)
        body = BodyPose(now.height if z else was.height, turned, shift)
        placed = held(replace(body, height=stood + (body.height or 0.0)), legs.limits)
        steps.append(replace(pace.step, twist=twist, body=placed))
    return steps


def _list(record: Record, name: str, kind: str) -> list[Record]:
    items = record.fields.get(name)
    if not isinstance(items, list) or not all(isinstance(item, Record) and item.type == kind for item in items):
        raise InvalidGoal(f"{name} is a list of {kind}")
    if len(items) > STEPS_MAX:
        raise InvalidGoal(f"{name} has at most {STEPS_MAX} items")
    return items


def _number(record: Record, *path: str) -> float:
    value: object = record
    for name in path:
        value = value.fields.get(name) if isinstance(value, Record) else None
    if not isinstance(value, int | float) or not abs(value) < 1e9:
        raise InvalidGoal(f"{'.'.join(path)} is a number")
    return float(value)
