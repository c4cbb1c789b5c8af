"""choreographer and dancer: ready-made dances with a few parameters (4.5). Values outside their ranges are clamped."""

from __future__ import annotations

from dataclasses import replace

from roboglot.model.components.motion.feet import Foot, Footfall
from roboglot.model.components.motion.legs import BodyPose, FootLift, Legs, Step
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Orientation, Twist
from roboglot.programs.functions.moving.attitudes import held
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES

ROCK = 0.08  # rad by which the body rocks in a moonwalk
SINK = 0.02  # m by which the body is lowered in a moonwalk
BEAT = 0.24  # s per step in place
BEAT_MIN, BEAT_MAX = 0.12, 1.0  # s
SLIDING = 0.015  # m by which the feet are lifted in a moonwalk
SWING, SWING_MAX = 0.8, 0.5  # part of a step with a pair in the air, and its maximum, s
PAIRS = (frozenset({Foot.LEFT_FRONT, Foot.RIGHT_REAR}), frozenset({Foot.RIGHT_FRONT, Foot.LEFT_REAR}))  # take turns
ENDS = 0.4  # s to get into position, and out of it
DEPTH = 0.08  # m by which a push-up lowers the body


class Choreography:
    """Last prepared steps and footfalls; heights are offsets from the robot's standing height, m."""

    def __init__(self, _session: Session) -> None:
        self.steps: list[Step] = []
        self.footfalls: list[Footfall] = []

    def close(self) -> None:
        """Do nothing, as nothing is held."""


@ABILITIES.on("choreographer.moonwalk")
async def moonwalk(session: Session, x_velocity: float, y_velocity: float, stride: float, number: int) -> None:
    """Prepare sliding at this velocity (m/s): ``number`` times four steps of a diagonal pair, ``stride`` m each.

    The step rate follows from both: a foot moves one stride in the time of two steps.
    """
    twist = Twist(_cut(x_velocity, -0.08, 0.08), _cut(y_velocity, -0.05, 0.05))
    length = _cut(stride, 0.001, 0.065)
    beat = _cut(length / twist.speed / 2, BEAT_MIN, BEAT_MAX) if twist.speed > 1e-6 else BEAT
    low = FootLift(SLIDING, SLIDING)
    lean = [Step(beat, twist, BodyPose(-SINK, Orientation(roll=side * ROCK)), low) for side in (1, 0, -1, 0)]
    head, tail = Step(ENDS, body=BodyPose(-SINK), lift=low), Step(ENDS, body=BodyPose(0.0), lift=low)
    prepared = session.part(Choreography)
    times = round(_cut(number, 1, 10))
    prepared.steps = [head, *(lean * times), tail]
    air, stand = min(SWING * beat, SWING_MAX), beat - min(SWING * beat, SWING_MAX)
    pairs = [(Footfall(air, pair), Footfall(stand, frozenset(Foot))) for pair in PAIRS]
    around = Footfall(ENDS, frozenset(Foot))
    prepared.footfalls = [around, *([fall for pair in pairs for fall in pair] * (2 * times)), around]


@ABILITIES.on("choreographer.push_up")
async def push_up(session: Session, frequency: int, number: int) -> None:
    """Prepare ``number`` push-ups, ``frequency`` a minute."""
    half = 30.0 / _cut(frequency, 10, 60)
    once = [Step(half, body=BodyPose(-DEPTH)), Step(half, body=BodyPose(0.0))]
    prepared = session.part(Choreography)
    prepared.steps, prepared.footfalls = once * round(_cut(number, 2, 10)), []


@ABILITIES.on("dancer.dance", needs=(Legs,))
async def dance(session: Session) -> None:
    """Perform what the choreographer prepared last, to its end; raises RobotError if the robot cannot."""
    prepared = session.part(Choreography)
    if not prepared.steps:
        raise InvalidGoal("the choreographer has prepared nothing")
    legs = session.robot[Legs]
    stood = legs.body_height

    def placed(step: Step) -> Step:
        body = BodyPose(stood + (step.body.height or 0.0), step.body.attitude)
        return replace(step, body=held(body, legs.limits))

    steps = [placed(step) for step in prepared.steps]
    await session.complete(legs.dance(steps, prepared.footfalls, source=session.source))


def _cut(value: float, least: float, most: float) -> float:
    if value != value:  # math.isnan takes no whole number beyond the largest float
        raise ValueError("not a number")
    return max(least, min(most, value))
