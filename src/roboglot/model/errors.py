"""What can go wrong with a robot, in the model's words. Each door translates these once, in its ``errors.py``."""

from __future__ import annotations


class RobotError(Exception):
    """Anything the robot refuses or fails to do; the message is a plain sentence for the log."""


class ComponentMissing(RobotError):
    """The robot has no such component."""

    def __init__(self, component: type) -> None:
        super().__init__(f"this robot has no {component.__name__.lower()}")
        self.component = component


class InvalidGoal(RobotError):
    """A value is out of range or makes no sense; nothing was started."""


class NotFound(RobotError):
    """A named thing (place, action, map, program) does not exist."""


class Busy(RobotError):
    """Another action holds the resource and may not be interrupted."""


class Refused(RobotError):
    """The robot's state does not allow it now (lying down, battery low, charging by wire, emergency stop …)."""


class EmergencyStopped(Refused):
    """An emergency stop is engaged."""


class NotReady(Refused):
    """What it needs is still being prepared; the same request succeeds in a while."""


class Unconnected(Refused):
    """The real robot behind the model cannot be reached now."""


class Unreachable(RobotError):
    """No path leads to the goal."""


class Blocked(RobotError):
    """Something stood in the way for too long."""


class NotLocalized(RobotError):
    """The robot does not know where it is."""


class DockNotFound(RobotError):
    """No charging dock is known, or it is not where it should be."""


class Expired(RobotError):
    """It took longer than it may."""
