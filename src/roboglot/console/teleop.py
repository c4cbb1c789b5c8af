"""Driving by hand from a page: numbered and stamped velocities, checked and timed out here, never by the page."""

from __future__ import annotations

from typing import Annotated

import msgspec

from roboglot.console.settings import DEAD_MAN, STALE
from roboglot.model.action import Action, ActionStatus
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import Driving
from roboglot.model.errors import Refused
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot

PAD = "pad"  # the kind of recorded inputs for gamepads
Share = Annotated[float, msgspec.Meta(ge=-1, le=1)]


class Velocity(msgspec.Struct, tag="drive", tag_field="type", forbid_unknown_fields=True):
    """Shares (-1 to 1) of the base's top speeds: forward, left, counter-clockwise.

    ``seq`` counts up. ``stamp``: the server's last time known to the page (ms), plus the time passed since.
    """

    robot: str
    seq: int
    stamp: float
    x: Share = 0.0
    y: Share = 0.0
    yaw: Share = 0.0


class Pad:
    """One page's manual control of one robot, which brakes after ``DEAD_MAN`` s of silence or with the page's end.

    Once something else has cancelled its motion, the pad must be let go before it drives again: a page repeats the
    velocity of a held key ten times a second, and *Stop* would last no longer than that.
    """

    def __init__(self, robot: Robot, source: str) -> None:
        self._robot, self._source = robot, source
        self._seq = -1
        self._action: Action | None = None  # since the pad was taken
        self.late = 0

    def drive(self, request: Velocity, now: float) -> bool:
        """Drive for ``DEAD_MAN`` s; ``now``: the server's time in ms. Return False for an old velocity, ignored.

        Raises the errors of driving (Busy, EmergencyStopped, …), and Refused while it is held after a stop.
        """
        if request.seq <= self._seq:
            self.late += 1
            return False
        if not (request.x or request.y or request.yaw):
            self._seq = request.seq
            self.let_go("the pad was let go")
            return True
        if not 0.0 <= now - request.stamp + 50.0 <= STALE * 1000.0 + 50.0:
            self.late += 1
            return False
        self._seq = request.seq
        if self._action is not None and self._action.status in (ActionStatus.CANCELING, ActionStatus.CANCELED):
            raise Refused("the robot was stopped, or another command took over: let go, then drive again")
        self.move(request.x, request.y, request.yaw)
        return True

    def move(self, x: float, y: float, yaw: float) -> None:
        """Drive with these shares of the base's top speeds. Raises the errors of driving."""
        limits = self._robot[Base].limits
        top = limits.twist
        twist = Twist(x * top.x, y * top.x if limits.holonomic else 0.0, yaw * top.yaw).clamped(top)
        with self._robot.inputs.noting(PAD, "move", {"source": self._source, "x": x, "y": y, "yaw": yaw}):
            self._action = self._robot[Driving].drive(twist, lifetime=DEAD_MAN * self._pace, source=self._source)

    def let_go(self, why: str) -> None:
        """End this page's driving."""
        self._action = None
        with self._robot.inputs.noting(PAD, "let_go", {"source": self._source, "why": why}):
            for action in self._robot.actions.running():
                if action.source == self._source:
                    action.cancel(why)

    @property
    def _pace(self) -> float:
        """Robot seconds per real second."""
        clock = self._robot.clock
        return clock.speed if isinstance(clock, RealClock) else 1.0
