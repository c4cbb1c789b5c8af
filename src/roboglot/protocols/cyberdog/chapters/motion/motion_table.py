"""The dog's motions by number, as walks, figures and body poses of the model. Knows no robot.

Numbers that are not here are not motions of the dog's.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import BodyPose
from roboglot.model.components.motion.motions import Motion as Figure
from roboglot.wire.cyberdog.chapters.motion.motion import RELATIVE_SHIFT_MAX, RELATIVE_TURN_MAX, Motion
from roboglot.wire.cyberdog.chapters.motion.names import FIGURE_NAMES, WALK_NAMES

WALKS: Mapping[int, Gait] = {number: Gait[name] for number, name in WALK_NAMES.items()}
FIGURES: Mapping[int, Figure] = {number: Figure[name] for number, name in FIGURE_NAMES.items()}
NUMBERS: Mapping[Figure, int] = {figure: number for number, figure in FIGURES.items()}
DANCES = frozenset({140, 176, 177, 178, 501, 502, 503, 504, 505})  # lying down may interrupt them
# Body poses: whether each is relative to the present one, and whether a duration is required.
POSES: Mapping[int, tuple[bool, bool]] = {
    201: (False, False),
    202: (True, False),
    203: (False, True),
    211: (False, True),
    Motion.POSE_RELATIVE: (True, True),
    Motion.POSE_ONE_FOOT: (True, True),
    214: (True, True),
}
SERVO_POSES = frozenset({201, 202})  # allowed in servo frames
SEEING = frozenset({343, 344, 345})  # walks that lift the feet over obstacles ahead
# States that the board enters by itself; clients cannot request them.
STATES = frozenset({Motion.LIFTED, Motion.ON_ITS_BACK})
PRESETS = frozenset(range(180, 200))  # slots for gaits that users load onto the dog; empty as delivered
USERS = frozenset({Motion.USER_SEQUENCE, Motion.USER_GAIT})
DANCED = USERS | {Motion.POSE_ONE_FOOT}  # performed as steps of a choreography here
WALK_STANDS = frozenset({Motion.WALK_STAND, Motion.WALK_STAND_OTHER})
POSTURES = WALK_STANDS | {Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP}
# Motions of fixed length: a duration is not allowed.
FIXED_TIME = POSTURES | FIGURES.keys() | PRESETS | {Motion.TROT_PASSIVE, Motion.USER_SEQUENCE}
MAY_LAST = WALKS.keys() | POSES.keys() | {Motion.USER_GAIT}
KNOWN = FIXED_TIME | MAY_LAST | STATES
ON_LEGS = FIGURES.keys() | POSES.keys() | USERS | PRESETS | STATES


def may_be_added(by: BodyPose) -> bool:
    """Return whether a relative pose may be this large; NaN may not. The legs follow as far as they can."""
    shift, turn = (by.shift.x, by.shift.y, by.height or 0.0), by.attitude
    turns = all(abs(angle) <= RELATIVE_TURN_MAX for angle in (turn.roll, turn.pitch, turn.yaw))
    return turns and all(abs(value) <= most for value, most in zip(shift, RELATIVE_SHIFT_MAX, strict=True))
