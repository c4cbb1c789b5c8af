"""Maps the model's errors to this protocol's codes in one table. Knows no handler."""

from __future__ import annotations

from roboglot.model import errors
from roboglot.values import dataclass
from roboglot.wire.cyberdog.chapters.motion.motion import MotionCode
from roboglot.wire.cyberdog.codes import Feedback, InBandError

ENDED = "error "  # before the name of gRPC's status


class RecordedEnd(Exception):
    """The recorded robot ended the call with a status of gRPC: ``code``."""

    def __init__(self, status: str) -> None:
        super().__init__(status)
        self.status, self.code = status, status.removeprefix(ENDED)

    @classmethod
    def check(cls, status: str) -> None:
        """Raise it for the recorded status of such an end."""
        if status.startswith(ENDED):
            raise cls(status)


@dataclass(frozen=True, slots=True)
class ErrorCodes:
    """Codes of one error: ``error_code`` of answers, ``code`` of motions, ``feedback_code`` of navigation."""

    in_band: InBandError
    motion: MotionCode
    navigation: Feedback


# First match wins.
CODES: tuple[tuple[type[errors.RobotError], ErrorCodes], ...] = (
    (errors.ComponentMissing, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.UNSUPPORTED, Feedback.ACTIVATION_FAILED)),
    (errors.InvalidGoal, ErrorCodes(InBandError.BAD_PARAMETERS, MotionCode.PARAMETERS, Feedback.NO_PATH)),
    (
        errors.EmergencyStopped,
        ErrorCodes(InBandError.UNAVAILABLE, MotionCode.EMERGENCY_STOPPED, Feedback.NAVIGATION_FAILED),
    ),
    (errors.Refused, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.STATE, Feedback.NAVIGATION_FAILED)),
    (errors.Busy, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.OTHER_SOURCE, Feedback.NAVIGATION_FAILED)),
    (errors.Blocked, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.STUCK, Feedback.NAVIGATION_FAILED)),
    (errors.Unreachable, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.EXECUTION, Feedback.NO_PATH)),
    (errors.Expired, ErrorCodes(InBandError.TIMEOUT, MotionCode.EXECUTION_TIMEOUT, Feedback.NAVIGATION_FAILED)),
    (errors.RobotError, ErrorCodes(InBandError.UNAVAILABLE, MotionCode.EXECUTION, Feedback.NAVIGATION_FAILED)),
)


def codes_of(error: errors.RobotError) -> ErrorCodes:
    """Return the codes for ``error``."""
    return next(codes for kind, codes in CODES if isinstance(error, kind))
