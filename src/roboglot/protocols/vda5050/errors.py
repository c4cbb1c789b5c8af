"""Translation of the model's errors into those of VDA 5050, and the reasons for which an order is refused."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from roboglot.model.errors import Forbidden, InvalidGoal, NotLocalized, Refused, RobotError, Unreachable
from roboglot.wire.vda5050.versions import ErrorKind, Level

NOTHING: Mapping[str, object] = MappingProxyType({})
KINDS: dict[type[RobotError], ErrorKind] = {
    Forbidden: ErrorKind.FORBIDDEN,
    Unreachable: ErrorKind.UNREACHABLE,
    InvalidGoal: ErrorKind.UNREACHABLE,
    NotLocalized: ErrorKind.NOT_AVAILABLE,
    Refused: ErrorKind.NOT_AVAILABLE,
    RobotError: ErrorKind.UNREACHABLE,
}


class Rejected(Exception):
    """Refused message of fleet control; ``references`` name the fields concerned."""

    def __init__(
        self, kind: ErrorKind, why: str, references: Mapping[str, object] = NOTHING, level: Level = Level.WARNING
    ) -> None:
        super().__init__(why)
        self.kind, self.level = kind, level
        self.references = {key: str(value) for key, value in references.items()}


class Ignored(Exception):
    """Message, or a part of one, that the standard has a robot leave without an error, as it hibernates."""


def kind_of(error: RobotError) -> ErrorKind:
    """Return the kind for ``error`` or its nearest ancestor in the table."""
    return next(KINDS[kind] for kind in type(error).__mro__ if kind in KINDS)
