"""Dialogue with a worker that checks a program instead of running it: one message, then the end. Knows no process."""

from __future__ import annotations

import asyncio

from roboglot.programs.engine.messages import CheckedMessage, ProtocolViolation, decode
from roboglot.programs.engine.worker_socket import Wire
from roboglot.programs.language import Problem, ProblemKind


class Checking:
    """The answer of a checking worker: ``problems`` once ``closed`` is done, None if it ended without one.

    ``uses``: requested names that the program reads without defining them.
    """

    def __init__(self) -> None:
        self.problems: list[Problem] | None = None
        self.uses: list[str] = []
        self.closed: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        self.wire = Wire(self)

    @property
    def full(self) -> bool:
        """False: a single message needs no back-pressure."""
        return False

    def take(self, body: bytes) -> bool:
        """Take the worker's message. Raises ProtocolViolation."""
        match decode(body):
            case CheckedMessage(problems=found, uses=uses):
                try:
                    self.problems = [
                        Problem(line, column, ProblemKind(kind), en, zh) for line, column, kind, en, zh in found
                    ]
                except ValueError as error:
                    raise ProtocolViolation(str(error)) from None
                self.uses = uses
                return False
        raise ProtocolViolation("an answer without a request")

    def broken(self, _error: Exception) -> None:
        """Record that the check got no answer."""
        self.problems = None

    def settle(self) -> None:
        """Note that the socket has ended."""
        if not self.closed.done():
            self.closed.set_result(None)
