"""Errors of a robot in the model's words. Each door translates them once, in its ``errors.py``."""

from __future__ import annotations

import re
from typing import Self

from roboglot.spelling import brief

SENTENCE_MAX = 1000  # characters of a message, which may quote a client


class RobotError(Exception):
    """Anything the robot refuses or fails to do; the message is a plain sentence for the log."""

    def __str__(self) -> str:
        """Return the message; a long one is cut off."""
        return brief(super().__str__(), SENTENCE_MAX)

    def again(self) -> Self:
        """Return a copy to raise again: each raise adds its stack, with all objects on it, to the raised error."""
        copied = type(self).__new__(type(self), *self.args)
        copied.args = self.args
        copied.__dict__.update(self.__dict__)
        return copied


def forget_stack(error: BaseException | None) -> None:
    """Release the stack frames of ``error`` and of its causes, with the objects they hold."""
    known: set[int] = set()
    waiting = [error]
    while waiting:
        if (one := waiting.pop()) is None or id(one) in known:
            continue
        known.add(id(one))
        one.__traceback__ = None
        waiting += [one.__cause__, one.__context__]


class ComponentMissing(RobotError):
    """The robot has no such component."""

    def __init__(self, component: type) -> None:
        words = re.sub("(?<=[a-z])(?=[A-Z])", " ", component.__name__).lower()
        super().__init__(f"this robot has no {words}")
        self.component = component


class InvalidGoal(RobotError):
    """A value is out of range or makes no sense; nothing was started."""


class NotFound(RobotError):
    """A named thing (place, action, map, program) does not exist."""


class Busy(RobotError):
    """Another action holds the resource and may not be interrupted."""


class Refused(RobotError):
    """The robot's state does not allow it now (lying down, battery low, charging by wire, emergency stop …)."""


class Forbidden(Refused):
    """The client lacks a right; the message names it."""


class EmergencyStopped(Refused):
    """An emergency stop is engaged."""


class NotReady(Refused):
    """Something that the request needs is still being prepared; it succeeds when repeated later."""


class Unconnected(Refused):
    """The real robot behind the model cannot be reached now."""


class Unreachable(RobotError):
    """No path leads to the goal."""


class Blocked(RobotError):
    """Something stood in the way for too long."""


class Collided(Blocked):
    """The hull touches something; only motion away from it is possible until it is free."""


class NotLocalized(RobotError):
    """The robot does not know where it is."""


class DockNotFound(RobotError):
    """No charging dock is known, or it is not where it should be."""


class Expired(RobotError):
    """Time limit of a request exceeded."""
