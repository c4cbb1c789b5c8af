"""Differences in naming between the two versions of VDA 5050."""

from __future__ import annotations

from enum import StrEnum

from roboglot.values import dataclass


class ErrorKind(StrEnum):
    """Reason for a refused or failed order or action; the value is version 3.0's word."""

    MALFORMED = "VALIDATION_FAILURE"
    UNSUPPORTED = "UNSUPPORTED_PARAMETER"
    ORDER_ACTION = "INVALID_ORDER_ACTION"
    INSTANT_ACTION = "INVALID_INSTANT_ACTION"
    OUTDATED = "OUTDATED_ORDER_UPDATE"
    SAME_UPDATE = "SAME_ORDER_UPDATE_ID"
    NOT_A_CONTINUATION = "INVALID_ORDER_UPDATE"
    AFTER_CANCEL = "ORDER_UPDATE_FOLLOWING_CANCEL"
    OTHER_ORDER = "OTHER_ORDER_ACTIVE"
    START_TOO_FAR = "START_NODE_OUT_OF_RANGE"
    UNREACHABLE = "NODE_UNREACHABLE"
    NO_ORDER = "NO_ORDER_TO_CANCEL"
    UNKNOWN_MAP = "UNKNOWN_MAP_ID"
    NOT_AVAILABLE = "MOBILE_ROBOT_NOT_AVAILABLE"
    ACTION_FAILED = "ACTION_FAILED"
    FORBIDDEN = "ACCESS_DENIED"  # ours: fleet control lacks the permission
    FAULT = "ROBOT_FAULT"  # ours: a part of the robot is broken


class Level(StrEnum):
    """Severity of an error; the value is version 3.0's word."""

    WARNING = "WARNING"
    URGENT = "URGENT"
    CRITICAL = "CRITICAL"  # the order cannot continue; another may be accepted
    FATAL = "FATAL"


@dataclass(frozen=True, slots=True)
class Version:
    """One version of the protocol: its number, its level in topics, and its words."""

    number: str
    level: str
    new_words: bool  # use 3.0's names of fields and values

    def error(self, kind: ErrorKind) -> str:
        """Return the errorType."""
        return kind.value if self.new_words else _OLD.get(kind, _camel(kind.value))

    def severity(self, level: Level) -> str:
        """Return the errorLevel; 2.1 knows two."""
        if self.new_words:
            return level.value
        return "FATAL" if level in (Level.CRITICAL, Level.FATAL) else "WARNING"


V2 = Version("2.1.0", "v2", new_words=False)
V3 = Version("3.0.0", "v3", new_words=True)
VERSIONS = {"2.1": V2, "3.0": V3}
_OLD = {
    ErrorKind.MALFORMED: "validationError",
    ErrorKind.UNSUPPORTED: "orderError",
    ErrorKind.ORDER_ACTION: "orderError",
    ErrorKind.INSTANT_ACTION: "instantActionError",
    ErrorKind.OUTDATED: "orderUpdateError",
    ErrorKind.SAME_UPDATE: "orderUpdateError",
    ErrorKind.NOT_A_CONTINUATION: "orderUpdateError",
    ErrorKind.AFTER_CANCEL: "orderUpdateError",
    ErrorKind.OTHER_ORDER: "orderUpdateError",
    ErrorKind.START_TOO_FAR: "noRouteError",
    ErrorKind.UNREACHABLE: "noRouteError",
}


def _camel(words: str) -> str:
    first, *rest = words.lower().split("_")
    return first + "".join(word.capitalize() for word in rest)
