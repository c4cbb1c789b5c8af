"""Current errors: refused messages and actions until they are corrected, and the robot's own faults."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Iterator

from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.robot import Robot
from roboglot.protocols.vda5050.errors import Rejected
from roboglot.values import dataclass
from roboglot.wire.vda5050.versions import ErrorKind, Level, Version

log = logging.getLogger(__name__)
ERRORS_MAX = 32
LEVELS = {FaultLevel.WARNING: Level.WARNING, FaultLevel.ERROR: Level.URGENT, FaultLevel.FATAL: Level.FATAL}


@dataclass(frozen=True, slots=True)
class Error:
    """Error that stays until corrected; with ``order``, until the next accepted order."""

    kind: ErrorKind
    level: Level
    why: str
    references: tuple[tuple[str, str], ...] = ()
    order: bool = True


class ErrorBook:
    """Errors of the state; ``changed`` is set with each new one."""

    def __init__(self, robot: Robot, version: Version, changed: asyncio.Event) -> None:
        self._robot, self._version, self._changed = robot, version, changed
        self._errors: list[Error] = []

    def __iter__(self) -> Iterator[Error]:
        """Yield the standing reported errors, then the robot's own faults."""
        yield from self._errors
        yield from self.faults()

    def refuse(self, rejected: Rejected, *, order: bool = True) -> None:
        """Report the reason why a message or an action was refused."""
        self.report(rejected.kind, rejected.level, str(rejected), rejected.references, order=order)

    def report(
        self, kind: ErrorKind, level: Level, why: str, references: dict[str, str] | None = None, *, order: bool = True
    ) -> None:
        """Store an error and send it."""
        error = Error(kind, level, why, tuple((references or {}).items()), order)
        if error not in self._errors:
            self._errors = [*self._errors, error][-ERRORS_MAX:]
            log.info("robot %s: fleet control is sent %s: %s", self._robot.id, self._version.error(kind), why)
        self._changed.set()

    def forget_order(self) -> None:
        """Drop the errors about the order, which was replaced or cancelled."""
        self._errors = [error for error in self._errors if not error.order]

    def forget_kind(self, kind: ErrorKind) -> None:
        """Drop the errors of one kind."""
        self._errors = [error for error in self._errors if error.kind is not kind]

    def forget_action(self, action_id: str) -> None:
        """Drop the errors about one action, which is tried again."""
        about = ("actionId", action_id)
        self._errors = [error for error in self._errors if about not in error.references]

    def faults(self) -> list[Error]:
        """Return the present faults of the robot itself."""
        if Health not in self._robot:
            return []
        return [
            Error(ErrorKind.FAULT, LEVELS[fault.level], fault.message, (("fault", fault.name),), order=False)
            for fault in self._robot[Health].faults[:ERRORS_MAX]
        ]
