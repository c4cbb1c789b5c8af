"""The control lease: the client that moves the robot, exclusive control, and its transfer. Knows no door and no driver.

Without a controller the newest command wins, and the one before is braked and ends. A controller (a person at the
terminal, or a named client) has exclusive control until it is released. A real robot that is moved by others, such as
the vendor's app, is left alone until they stop or control is taken.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Callable

from msgspec.structs import astuple

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.components.logistics.jack import JACK
from roboglot.model.components.motion.arm import ARM
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.gimbal import GIMBAL
from roboglot.model.components.motion.gripper import GRIPPER
from roboglot.model.components.motion.legs import LEGS
from roboglot.model.components.motion.servo import SERVO
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.components.system.link import OTHERS, Link
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Busy, InvalidGoal
from roboglot.model.events import ActionChanged, ControlChanged, ControlRefused, LinkChanged
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.values import dataclass

log = logging.getLogger(__name__)
PERSON = "a person"
TEACHER = "console teacher"  # of a class, whose robots are locked: a role, and no client
ITSELF = "the robot itself"
ERRAND = "errand"  # the resource of actions that move the robot by a sequence of other actions
MOVING = (BASE, LEGS, ARM, GRIPPER, GIMBAL, JACK, ERRAND)  # the resources that control covers, besides those of servos
TAKEN, OUTSIDE = "control taken", "moved by another client"  # the faults' names
KEPT = "control.taken_by"  # the setting
NAME_MAX = 80  # characters
LOG_PERIOD = 1.0  # s


@dataclass(frozen=True, slots=True)
class Holder:
    """Current mover: a client's name, ``OTHERS`` or ``ITSELF``; the action; its start, robot s."""

    who: str
    doing: str
    since: float


class Lease(Component):
    """Lease of a robot. Publishes ``ControlChanged``; Health warns while control is taken or others move it."""

    def __init__(self, robot: Robot) -> None:
        self._robot, self._clock = robot, robot.clock
        self._taken_by = str(robot[Settings].get(KEPT, "")) if Settings in robot else ""
        self._last = Holder("", "", self._clock.time())
        self.stopped = ""  # why a person stopped it, until a client moves it, starts a program, or control is released
        self._outside_since: float | None = None
        self._fence: Callable[[], str] = str  # no fence: every client may drive
        self._logged_at = -math.inf
        robot.actions.guard(self._admit)
        robot.events.listen(ActionChanged, lambda event: self._look() if moves(event.action) else None)
        robot.events.listen(LinkChanged, lambda _: self._look_outside())
        if self._taken_by:
            log.warning("robot %s: control is still taken by %s", robot.id, self._taken_by)
            self._report()

    @property
    def taken_by(self) -> str:
        """Client with exclusive control; empty: any client may move it, the newest command wins."""
        return self._taken_by

    @property
    def holder(self) -> Holder | None:
        """Current holder; None while the robot is not being moved."""
        if self._outside_since is not None:
            return Holder(OTHERS, "", self._outside_since)
        running = [action for action in self._robot.actions.running() if moves(action)]
        if not running:
            return None
        newest = running[-1]
        return Holder(newest.client or ITSELF, newest.name, newest.started_at)

    @property
    def last(self) -> Holder:
        """Client that moves the robot, or moved it last; an empty name before the first."""
        return self._last

    def may_move(self, who: str) -> bool:
        """Return whether ``who`` may move the robot."""
        taken = self._taken_by
        return not taken or who == taken or who.startswith((f"{taken} ", f"{taken}:"))

    def fence(self, why_not: Callable[[], str]) -> None:
        """Set a check before every motion: it returns why this program may not move the robot; empty: it may."""
        self._fence = why_not

    def halt(self, reason: str) -> None:
        """Stop all motion, regardless of control."""
        for action in self._robot.actions.running():
            if moves(action):
                action.cancel(reason)

    async def take(self, who: str = PERSON) -> None:
        """Give exclusive control to ``who``: ``PERSON`` (no client at all), or a door or client, by its name:
        "robomaster", "robomaster 10.0.0.7", "robomaster 10.0.0.7:4242".

        Returns once motions of all others have braked. Those of another client of a real robot are stopped where the
        protocol allows it (Refused if the robot does not obey, Unconnected without a link). Control survives
        restarts. Raises InvalidGoal, and the disk's error if it cannot be stored: it then lasts until the program ends.
        """
        if not who.isprintable() or not 0 < len(who.strip()) <= NAME_MAX:
            raise InvalidGoal(f"a client's name has 1 to {NAME_MAX} printable characters")
        self._taken_by = who.strip()
        log.warning("robot %s: control is taken by %s", self._robot.id, self._taken_by)
        self._report()
        doomed = [a for a in self._robot.actions.running() if moves(a) and not self.may_move(a.client)]
        for action in doomed:
            self._publish_refused(action, f"{self._taken_by} took control")
            action.cancel(f"{self._taken_by} took control")
        await self._keep()
        for action in doomed:
            await action.done()
        if Link in self._robot:
            await self._robot[Link].take_back()

    @property
    def client(self) -> str:
        """Name of the controlling client without its door; empty for a whole door, a person, a teacher, or none."""
        return "" if self._taken_by in (PERSON, TEACHER) else self._taken_by.partition(" ")[2]

    def is_of(self, who: str) -> bool:
        """Return whether the client with identity ``who`` has control, at any door."""
        return bool(who) and (self.client == who or self.client.startswith(f"{who}:"))

    async def release(self) -> None:
        """Release control, so that every client may move the robot; return once that is stored."""
        self.stopped = ""
        if self._taken_by:
            log.warning("robot %s: %s released control", self._robot.id, self._taken_by)
            self._taken_by = ""
            self._report()
            await self._keep()

    async def _keep(self) -> None:
        if Settings in self._robot:
            await self._robot[Settings].put(KEPT, self._taken_by)

    @property
    def locked(self) -> str:
        """Reason why no program may start while a teacher has locked the robot; empty: programs may."""
        return f"the teacher has locked robot {self._robot.id}" if self._taken_by == TEACHER else ""

    @property
    def _taken(self) -> str:
        words = f"control is taken by {self._taken_by}"
        return self.locked or words

    def _admit(self, action: Action) -> None:
        """Raise Busy for an action that may not start. Stopping is allowed unless others move a real robot."""
        if not moves(action):
            return
        if (fenced := self._fence()) and not _stops(action.goal):
            why = fenced
        elif self._outside_since is not None:
            why = "another client moves the robot; it is free when that is done, or when control is taken"
        elif not self.may_move(action.client) and not _stops(action.goal):
            why = self._taken
        else:
            if action.client and not _stops(action.goal):
                self.stopped = ""
            return
        self._publish_refused(action, why)
        raise Busy(why)

    def _publish_refused(self, action: Action, why: str) -> None:
        event = ControlRefused(stamp=self._clock.time(), client=action.client, doing=action.name, reason=why)
        self._robot.events.publish(event)

    def _look(self) -> None:
        holder = self.holder
        if holder is not None and holder.who != self._last.who:
            self._log(holder)
            self._last = holder
            self._publish()

    def _log(self, holder: Holder) -> None:
        """Log at most one line per second, even when clients keep taking control from each other."""
        if self._clock.time() - self._logged_at >= LOG_PERIOD:
            self._logged_at = self._clock.time()
            log.info("robot %s is moved by %s (%s)", self._robot.id, holder.who, holder.doing or "unknown motion")

    def _look_outside(self) -> None:
        outside = self._robot[Link].holder == OTHERS
        if outside is (self._outside_since is not None):
            return
        self._outside_since = self._clock.time() if outside else None
        if outside:
            self._look()
        else:
            log.info("robot %s: the other client has finished", self._robot.id)
        self._report()

    def _report(self) -> None:
        if Health in self._robot:
            health = self._robot[Health]
            for fault in (TAKEN, OUTSIDE):
                health.set(fault, False, "lease", FaultLevel.WARNING)
            if self._taken_by:
                health.set(TAKEN, True, "lease", FaultLevel.WARNING, self._taken)
            if self._outside_since is not None:
                health.set(OUTSIDE, True, "lease", FaultLevel.WARNING, "another client moves the robot")
        self._publish()

    def _publish(self) -> None:
        holder = self.holder
        who = holder.who if holder else ""
        self._robot.events.publish(ControlChanged(stamp=self._clock.time(), holder=who, taken_by=self._taken_by))


def moves(action: Action) -> bool:
    """Return whether the action needs control."""
    return any(resource in MOVING or resource.startswith(SERVO) for resource in action.resources)


def _stops(goal: object) -> bool:
    return isinstance(goal, Twist | WheelSpeeds) and not any(astuple(goal))
