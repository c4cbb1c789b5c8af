"""The dog's motions by number: which of the model's walks, figures and body poses each is. Knows no robot.

Numbers that are not here (a user's own gaits, climbing by sight, a paw held out) are motions that nothing here can do.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.gaits import Gait
from roboglot.model.components.motions import Motion as Figure
from roboglot.wire.cyberdog.motions import Motion

WALKS: Mapping[int, Gait] = {
    Motion.TROT_PASSIVE: Gait.TROT_PASSIVE,
    301: Gait.BOUND,
    302: Gait.PRONK,
    Motion.TROT_SLOW: Gait.TROT_SLOW,
    Motion.TROT_ADAPTIVE: Gait.TROT_ADAPTIVE,
    Motion.TROT_FAST: Gait.TROT_FAST,
    306: Gait.THREE_LEGS,
    307: Gait.SPIN,
    Motion.TROT_MEDIUM: Gait.TROT_MEDIUM,
    309: Gait.FOLLOW,
    310: Gait.BALLET,
    311: Gait.HOP,
    340: Gait.STAIRS,
    341: Gait.STAIRS,
    342: Gait.SLOPE,
}
FIGURES: Mapping[int, Figure] = {
    117: Figure.GET_UP_FAST,
    118: Figure.GET_UP_SLOW,
    119: Figure.GET_UP,
    120: Figure.SOMERSAULT_STAND,
    121: Figure.BACK_FLIP,
    122: Figure.FRONT_FLIP,
    123: Figure.BOW,
    124: Figure.ROLL_LEFT,
    126: Figure.JUMP_STAIR,
    127: Figure.FLIP_RIGHT,
    128: Figure.FLIP_LEFT,
    129: Figure.RUN_FRONT_FLIP,
    130: Figure.JUMP_LEFT_TURN,
    131: Figure.JUMP_RIGHT_TURN,
    132: Figure.JUMP_FORWARD_60,
    133: Figure.JUMP_FORWARD_30,
    134: Figure.JUMP_LEFT_20,
    135: Figure.JUMP_RIGHT_20,
    136: Figure.JUMP_UP_30,
    137: Figure.JUMP_DOWN_STAIR,
    138: Figure.ROLL_RIGHT,
    139: Figure.RUN_FLIP,
    140: Figure.DANCE_COLLECTION,
    141: Figure.SHAKE_LEFT_HAND,
    142: Figure.SHAKE_RIGHT_HAND,
    Motion.SIT_DOWN: Figure.SIT_DOWN,
    144: Figure.HIP_CIRCLE,
    145: Figure.HEAD_CIRCLE,
    146: Figure.STRETCH,
    147: Figure.JUMP_DOWN_PLATFORM,
    148: Figure.WAG_LEFT,
    149: Figure.WAG_RIGHT,
    150: Figure.WAG,
    151: Figure.BALLET,
    152: Figure.MOONWALK,
    153: Figure.JUMPING_JACK_FRONT,
    154: Figure.JUMPING_JACK_REAR,
    155: Figure.LIFT_LEFT_AND_NOD,
    156: Figure.LIFT_RIGHT_AND_NOD,
    157: Figure.SPREAD_LEFT_FRONT,
    158: Figure.SPREAD_RIGHT_FRONT,
    159: Figure.WALK_AND_NOD,
    160: Figure.WALK_SPREADING,
    161: Figure.STEP_AND_NOD,
    162: Figure.FRONT_LEGS_JUMP,
    163: Figure.REAR_LEGS_JUMP,
    164: Figure.LIFT_FRONT_LEGS,
    165: Figure.LIFT_REAR_LEGS,
    166: Figure.JUMP_COLLECTION,
    167: Figure.STEP_STRETCHING,
    168: Figure.JUMP_SWINGING,
    169: Figure.STEP_SWINGING,
    170: Figure.STEP_RIGHT_LEG,
    171: Figure.STEP_LEFT_LEG,
    172: Figure.BACK_FLIPS,
    173: Figure.SQUAT,
    174: Figure.PUSH_UP,
    175: Figure.BOW_AND_HEART,
    176: Figure.DANCE_1,
    177: Figure.DANCE_2,
    178: Figure.DANCE_3,
    179: Figure.FRONT_FLIP_CLAP,
    500: Figure.JUMP_RAISE_HAND,
    501: Figure.DANCE_4,
    502: Figure.DANCE_5,
    503: Figure.DANCE_6,
    504: Figure.DANCE_7,
    505: Figure.DANCE_8,
    506: Figure.PLATFORM_BACK_FLIP,
    507: Figure.PLATFORM_FRONT_FLIP,
    508: Figure.SKATEBOARD_BACK_FLIP,
    509: Figure.SKATEBOARD_FRONT_FLIP,
    510: Figure.SKATEBOARD_BALANCE,
    511: Figure.SKATEBOARD_KICK,
    512: Figure.WALK_UPRIGHT,
    513: Figure.HANDSTAND_SPLIT,
}
NUMBERS: Mapping[Figure, int] = {figure: number for number, figure in FIGURES.items()}
DANCES = frozenset({140, 176, 177, 178, 501, 502, 503, 504, 505})  # lying down may interrupt them
# Body poses: whether each adds to how the body is held, and whether a duration must be given.
POSES: Mapping[int, tuple[bool, bool]] = {
    201: (False, False),
    202: (True, False),
    203: (False, True),
    211: (False, True),
    Motion.POSE_RELATIVE: (True, True),
    214: (True, True),
}
POSTURES = frozenset(
    {Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP, Motion.WALK_STAND}
)
# What takes its own time: a duration must not be given.
FIXED_TIME = POSTURES | FIGURES.keys() | {Motion.TROT_PASSIVE}
MAY_LAST = WALKS.keys() | POSES.keys()
KNOWN = FIXED_TIME | MAY_LAST
