"""Reasons for refused motions in plain words, for the log and for viewers of the exchange. Knows no robot."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.protocols.cyberdog.chapters.motion.motion_start import MotionRequest
from roboglot.protocols.cyberdog.chapters.motion.motion_table import FIXED_TIME, POSES, may_be_added
from roboglot.wire.cyberdog.chapters.motion.motion import (
    RELATIVE_SHIFT_MAX,
    RELATIVE_TURN_MAX,
    CommandType,
    Motion,
    MotionCode,
)

DURATION_MAX = 60.0  # s: the longest walk by a result command, which only an emergency stop ends
REASONS: Mapping[MotionCode, str] = {
    MotionCode.OTHER_SOURCE: "another protocol took over",
    MotionCode.STATE: "the robot is in no state for it: its power, an update, or a body held up or on its back",
    MotionCode.UNSUPPORTED: "there is no such motion, or the body cannot do it",
    MotionCode.BUSY: "another motion, or another client's servo, is under way",
    MotionCode.LOW_BATTERY: "the charge is at 20 % or less",
    MotionCode.BANNED: "the robot enters this state by itself; it cannot be requested",
    MotionCode.EXECUTION_TIMEOUT: "the motion took too long",
    MotionCode.EXECUTION: "the motion was interrupted",
    MotionCode.NO_SEQUENCE: "no such gait or sequence is on the robot",
    MotionCode.MOTOR_OFFLINE: "a motor does not turn",
    MotionCode.MOTOR_HOT: "a motor is too hot for figures",
    MotionCode.EMERGENCY_STOPPED: "an emergency stop is in force; standing up (111) ends it",
    MotionCode.STUCK: "an obstacle is in the way",
    MotionCode.CHARGING: "the charging cable is plugged in",
}


def lasts_as_allowed(motion: int, seconds: float) -> bool:
    """Return whether a duration is given where the motion needs one, and only there."""
    return not _wrong_duration(motion, seconds)


def asks_too_much(motion: int, request: MotionRequest) -> bool:
    """Return whether a relative pose is out of range; the legs check absolute ones."""
    relative, _ = POSES.get(motion, (False, False))
    return relative and not may_be_added(request.body)


def reason(code: MotionCode, motion: int, request: MotionRequest) -> str:
    """Return why ``request`` was refused with ``code``."""
    if code is not MotionCode.PARAMETERS:
        return REASONS[code]
    if wrong := _wrong_duration(motion, request.seconds):
        return wrong
    if asks_too_much(motion, request):
        shifts = ", ".join(f"{most:g}" for most in RELATIVE_SHIFT_MAX)
        return f"a relative pose shifts by at most {shifts} m and turns by at most {RELATIVE_TURN_MAX:g} rad"
    return f"motion {motion} cannot be done with these values"


def servo_reason(code: MotionCode, motion: int, cmd_type: int) -> str:
    """Return why a frame with ``cmd_type`` was refused with ``code``."""
    if code is MotionCode.PARAMETERS and cmd_type not in tuple(CommandType):
        return f"cmd_type is 0, 1 or 2, not {cmd_type}"
    return reason(code, motion, MotionRequest(seconds=1.0))


def _wrong_duration(motion: int, seconds: float) -> str:
    """Return what is wrong with the duration; empty if nothing is."""
    if not 0 <= seconds <= DURATION_MAX:
        return f"duration is 0 to {1000 * DURATION_MAX:.0f} ms"
    fixed, needs_none = motion in FIXED_TIME, motion in POSES and not POSES[motion][1]
    if fixed and seconds > 0:
        return f"motion {motion} has its own time: leave duration out"
    if not fixed and not needs_none and motion != Motion.USER_GAIT and seconds == 0:
        return f"motion {motion} needs a duration in ms"
    return ""
