"""How the model's errors are told in this protocol: one table. Knows no handler."""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.model import errors
from roboglot.wire.cyberdog.codes import Feedback, InBandError
from roboglot.wire.cyberdog.motions import MotionCode


@dataclass(frozen=True, slots=True)
class Told:
    """One error as an answer's ``error_code``, as a motion's ``code``, as navigation's ``feedback_code``."""

    in_band: InBandError
    motion: MotionCode
    navigation: Feedback


# The first row whose class fits counts.
TABLE: tuple[tuple[type[errors.RobotError], Told], ...] = (
    (errors.ComponentMissing, Told(InBandError.UNAVAILABLE, MotionCode.UNSUPPORTED, Feedback.ACTIVATION_FAILED)),
    (errors.InvalidGoal, Told(InBandError.BAD_PARAMETERS, MotionCode.PARAMETERS, Feedback.NO_PATH)),
    (errors.EmergencyStopped, Told(InBandError.UNAVAILABLE, MotionCode.EMERGENCY_STOPPED, Feedback.NAVIGATION_FAILED)),
    (errors.Refused, Told(InBandError.UNAVAILABLE, MotionCode.STATE, Feedback.NAVIGATION_FAILED)),
    (errors.Busy, Told(InBandError.UNAVAILABLE, MotionCode.OTHER_SOURCE, Feedback.NAVIGATION_FAILED)),
    (errors.Blocked, Told(InBandError.UNAVAILABLE, MotionCode.STUCK, Feedback.NAVIGATION_FAILED)),
    (errors.Unreachable, Told(InBandError.UNAVAILABLE, MotionCode.EXECUTION, Feedback.NO_PATH)),
    (errors.Expired, Told(InBandError.TIMEOUT, MotionCode.EXECUTION_TIMEOUT, Feedback.NAVIGATION_FAILED)),
    (errors.RobotError, Told(InBandError.UNAVAILABLE, MotionCode.EXECUTION, Feedback.NAVIGATION_FAILED)),
)


def told(error: errors.RobotError) -> Told:
    """How ``error`` is told."""
    return next(told for kind, told in TABLE if isinstance(error, kind))
