"""cyberdog.motion.run_sequence: a choreography that the program wrote, pace by pace (4.4.04).

What a program fills in is hostile: kinds, counts and times are checked here, ranges by the robot's legs.
"""

from __future__ import annotations

import math
from typing import Any

from roboglot.model.components.legs import STEPS_MAX, BodyPose, Legs, Step
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Orientation, Point, Twist
from roboglot.programs.functions.attitudes import held
from roboglot.programs.functions.outcomes import told
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

SEQUENCE = 400  # MotionId
GAIT_UNIT = 0.03  # s: the robot counts a gait's duration in these, whatever the manual says
NAME_MAX = 128  # characters
LANDING_GAIN_MAX = 1.5  # the manual says 1, its own examples 1.5
NO_FEET = "body and way follow the paces; single feet, weights, friction and landing are checked, but change nothing"
FEET = ("right_forefoot", "left_forefoot", "right_hindfoot", "left_hindfoot")


@ABILITIES.on("cyberdog.motion.run_sequence", partial=NO_FEET)
async def run_sequence(session: Session, sequence: Any) -> Record:
    """Walk and hold the body as the pace list says, then stand straight; a pace's duration is in ms.

    A pace's twist has m/s and, as linear.z, degrees/s; its centroid has m from how the robot stands, and degrees.
    """
    if not isinstance(sequence, Record) or sequence.type != "MotionSequence":
        raise TypeError("run_sequence() takes a MotionSequence")
    wrong = ""
    try:
        _check(sequence)
        paces = [_pace(pace) for pace in _list(sequence, "pace_list", "MotionSequencePace")]
    except InvalidGoal as error:
        wrong, paces = str(error), []

    async def do() -> None:
        legs = session.robot[Legs]
        steps = [_step(pace, legs) for pace in paces]
        await session.complete(legs.dance(steps, source=session.source))

    outcome, response = await told(session, SEQUENCE, wrong, do())
    body = {"result": response["result"], "code": response["code"], "describe": outcome.fields["describe"]}
    fields = {"state": outcome, "response": Record("MotionSequenceServiceResponseBody", body)}
    return Record("MotionSequenceServiceResponse", fields)


def _check(sequence: Record) -> None:
    """Raises InvalidGoal for a sequence without a name or paces, and for gaits that make no sense."""
    name = sequence.fields.get("name")
    if not isinstance(name, str) or not name.isidentifier() or len(name) > NAME_MAX:
        raise InvalidGoal("a sequence's name follows the rules of variables' names")
    if not _list(sequence, "pace_list", "MotionSequencePace"):
        raise InvalidGoal("a sequence has paces")
    for gait in _list(sequence, "gait_list", "MotionSequenceGait"):
        if _number(gait, "duration") * GAIT_UNIT <= 0:
            raise InvalidGoal("a gait takes time")
        if any(_number(gait, foot) not in (0, 1) for foot in FEET):
            raise InvalidGoal("a foot is on the ground (1) or not (0)")


def _pace(pace: Record) -> Step:
    """What is to be done, with the height as an offset."""
    for foot in FEET:
        for axis in "xyzw":
            _number(pace, foot, axis)
    for part in ("linear", "angular"):
        for axis in "xyz":
            _number(pace, "weight", part, axis)
    if not 0.0 <= _number(pace, "landing_gain") <= LANDING_GAIN_MAX:
        raise InvalidGoal(f"landing_gain is 0 to {LANDING_GAIN_MAX}")
    if not 0.1 <= _number(pace, "friction_coefficient") <= 1.0:
        raise InvalidGoal("friction_coefficient is 0.1 to 1")
    x, y, yaw = (_number(pace, "twist", "linear", axis) for axis in "xyz")
    shift_x, shift_y, height = (_number(pace, "centroid", "position", axis) for axis in "xyz")
    angles = (math.radians(_number(pace, "centroid", "orientation", axis)) for axis in "xyz")
    body = BodyPose(height, Orientation(*angles), Point(shift_x, shift_y))
    return Step(_number(pace, "duration") / 1000.0, Twist(x, y, math.radians(yaw)), body)


def _step(pace: Step, legs: Legs) -> Step:
    """With the height above the floor, counted from how the robot stands now; cut to what the legs can hold."""
    body, offset = pace.body, pace.body.height or 0.0
    posed = BodyPose(legs.body_height + offset, body.attitude, body.shift)
    return Step(pace.seconds, pace.twist, held(posed, legs.limits))


def _list(record: Record, name: str, kind: str) -> list[Record]:
    items = record.fields.get(name)
    if not isinstance(items, list) or not all(isinstance(item, Record) and item.type == kind for item in items):
        raise InvalidGoal(f"{name} is a list of {kind}")
    if len(items) > STEPS_MAX:
        raise InvalidGoal(f"{name} has at most {STEPS_MAX} items")
    return items


def _number(record: Record, *path: str) -> float:
    value: Any = record
    for name in path:
        value = value.fields.get(name) if isinstance(value, Record) else None
    if not isinstance(value, int | float) or not abs(value) < 1e9:
        raise InvalidGoal(f"{'.'.join(path)} is a number")
    return float(value)
