"""Numbers of motions with their own rules, and codes of results. Knows no robot."""

from enum import IntEnum


class Motion(IntEnum):
    """Motions with their own rules in the protocol or on the robot."""

    EMERGENCY_STOP = 0
    LIE_DOWN = 101
    LIE_DOWN_PASSIVE = 102
    STAND_UP = 111
    WALK_STAND = 112
    WALK_STAND_OTHER = 113
    LIFTED = 114
    ON_ITS_BACK = 115
    TROT_PASSIVE = 125
    SIT_DOWN = 143
    POSE_RELATIVE = 212
    POSE_ONE_FOOT = 213
    TROT_SLOW = 303
    TROT_ADAPTIVE = 304
    TROT_FAST = 305
    TROT_MEDIUM = 308
    USER_SEQUENCE = 400
    USER_GAIT = 401


# Motions allowed with a low battery.
ALLOWED_ON_LOW_BATTERY = frozenset(
    {Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP, Motion.POSE_RELATIVE}
)
# Limits of relative poses in the developer guide's table of parameters: x, y, z in m, each angle in rad.
RELATIVE_SHIFT_MAX, RELATIVE_TURN_MAX = (0.4, 0.3, 0.2), 0.9
# Motions that begin or end an emergency stop.
ALLOWED_WHEN_STOPPED = frozenset({Motion.EMERGENCY_STOP, Motion.STAND_UP})


class CommandType(IntEnum):
    """``cmd_type`` of a servo frame."""

    START = 0
    DATA = 1
    END = 2


class MotionCode(IntEnum):
    """``code`` of 1003 and 1004."""

    DONE = 0
    OTHER_SOURCE = 3001
    STATE = 3003
    UNSUPPORTED = 3008
    PARAMETERS = 3010
    BUSY = 3011
    LOW_BATTERY = 3013
    BANNED = 3022
    EXECUTION_TIMEOUT = 3028
    EXECUTION = 3029
    NO_SEQUENCE = 3031
    MOTOR_OFFLINE = 3032
    MOTOR_HOT = 3033
    EMERGENCY_STOPPED = 3040
    STUCK = 3041
    CHARGING = 3056


class SwitchStatus(IntEnum):
    """``status`` of 1003: state of the change to the commanded motion."""

    NORMAL = 0
    CHANGING = 1
    EMERGENCY_STOPPED = 2
    LOW_BATTERY = 7
