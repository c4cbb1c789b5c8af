"""One fault of a robot."""

from __future__ import annotations

from enum import IntEnum

from roboglot.values import dataclass


class FaultLevel(IntEnum):
    """Severity of a fault."""

    WARNING = 1
    ERROR = 2
    FATAL = 3


@dataclass(frozen=True, slots=True)
class Fault:
    """``name`` is stable ("battery low"), ``component`` the part's name, ``id`` counts up, ``since`` is robot time."""

    id: int
    name: str
    component: str
    level: FaultLevel
    message: str
    since: float
