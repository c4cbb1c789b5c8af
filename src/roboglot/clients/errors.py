"""Errors between a client and its robot, the same for all vendors."""

from __future__ import annotations


class ClientError(Exception):
    """Anything that a client's call fails with; the message is a plain sentence.

    ``status``: the end of the call in the tap's words.
    """

    status = "no answer"


class LinkLost(ClientError):
    """No connection, or it broke before the answer; the robot may or may not have obeyed."""


class TimedOut(LinkLost):
    """The robot did not answer in time."""


class BadAnswer(ClientError):
    """The robot sent an answer that its protocol does not know."""


class RefusedByRobot(ClientError):
    """The robot refused: ``code`` and ``words`` are its own, ``operation``: the request."""

    def __init__(self, operation: str, code: int | str, words: str) -> None:
        super().__init__(f"{operation}: {code} {words}".rstrip())
        self.operation = operation
        self.code = code
        self.words = words
