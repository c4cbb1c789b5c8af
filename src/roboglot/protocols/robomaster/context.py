"""The SDK session: one per robot, begun by ``command``, shared by every control connection that uses it.

It ends with ``quit`` or with its last connection; then its motions are stopped and the settings that it changed are
restored. Knows no sockets: connections are members that join and leave.
"""

from __future__ import annotations

import itertools
import logging
from collections.abc import Callable, Hashable
from contextvars import ContextVar
from functools import partial
from typing import Any, Protocol, TypeVar

from roboglot.model.actions import Action
from roboglot.model.client_context import set_client
from roboglot.model.components.motion.gimbal import FollowMode, Gimbal
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import RobotError
from roboglot.model.geometry import ORIGIN
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster import readings
from roboglot.protocols.robomaster.answers import FastPath
from roboglot.protocols.robomaster.ports.media_port import MediaPort
from roboglot.protocols.robomaster.pushes import Pushes
from roboglot.wire.robomaster.replies import Profile

log = logging.getLogger(__name__)


class ChapterState(Protocol):
    """State that a chapter keeps between its commands."""

    def __init__(self, context: Context) -> None: ...

    def reset(self) -> None:
        """Go back to the state before the session."""


P = TypeVar("P", bound=ChapterState)
_speaker: ContextVar[str] = ContextVar("speaker", default="nobody")


def act_as(name: str, identity: str = "") -> None:
    """Attribute this task's commands to ``name`` with the proven ``identity`` from here on."""
    _speaker.set(name)
    set_client(f"robomaster {identity or name}", name, identity)


class Outlets(Protocol):
    """Outlets for a session's media and pushes; implemented by the server."""

    video: MediaPort
    audio: MediaPort

    def push(self, datagram: bytes, host: str) -> None:
        """Send a datagram to the client at ``host``."""

    def send_event(self, event: bytes) -> None:
        """Send an event to all readers of the event port."""


class Context:
    """State that the commands of all connections share."""

    robot: Robot
    profile: Profile

    def __init__(self, robot: Robot, profile: Profile, outlets: Outlets) -> None:
        self.robot = robot
        self.profile = profile
        self.outlets = outlets
        self.active = False
        self.origin = ORIGIN  # of chassis positions, in the odometry's frame
        self.pushes = Pushes(robot.clock, profile, self.send)
        for module, reads in readings.PUSHED.items():
            self.pushes.offer(module, [(name, partial(read, self)) for name, read in reads.items()])
        self._mode = FollowMode.CHASSIS_LEAD
        self._parts: dict[type[ChapterState], Any] = {}
        self._undo: dict[str, Callable[[], object]] = {}
        self._members: dict[Hashable, str] = {}
        self.repeated: dict[bytes, FastPath] = {}  # by received line; cleared when SDK mode is entered or left
        self._numbers = itertools.count(1)
        self._name = ""  # each session has its own: the first part of the source of its actions

    @property
    def source(self) -> str:
        """Source of actions of the current command: this session, and the connection that sent it."""
        return f"{self._name} {_speaker.get()}"

    @property
    def mode(self) -> FollowMode:
        """Follow mode of the gimbal in yaw, if there is one."""
        return self.robot[Gimbal].mode if Gimbal in self.robot else self._mode

    def set_mode(self, mode: FollowMode) -> None:
        """Set the follow mode. Raises ComponentMissing for GIMBAL_LEAD without a gimbal."""
        if mode is FollowMode.GIMBAL_LEAD or Gimbal in self.robot:
            self.robot[Gimbal].set_mode(mode)
        self._mode = mode

    def begin(self) -> None:
        """Enter SDK mode with everything at its default. Raises Unconnected for a lost real robot."""
        self.set_mode(FollowMode.CHASSIS_LEAD)
        self.active = True
        self._forget_lines()
        self._name = f"robomaster#{next(self._numbers)}"
        if self.profile.as_robots and Odometry in self.robot:
            self.origin = self.robot[Odometry].reading.pose

    def end(self, reason: str, *, hard: bool = False) -> list[Action]:
        """Leave SDK mode; return the cancelled actions, which may still be braking (``hard``: at full force)."""
        if not self.active:
            return []
        stopping = [action for action in self.robot.actions.running() if action.source.startswith(f"{self._name} ")]
        for action in stopping:
            action.cancel(reason, hard=hard)
        self.active = False
        self._forget_lines()
        self.pushes.reset()
        for part in self._parts.values():
            part.reset()
        self._parts.clear()
        for undo in (lambda: self.set_mode(FollowMode.CHASSIS_LEAD), *self._undo.values()):
            try:
                undo()
            except RobotError as error:  # a real robot that is gone has ended the session itself
                log.info("robomaster: cannot restore a setting: %s", error)
        self._undo.clear()
        self._members.clear()
        return stopping

    def moves(self, name: str) -> bool:
        """Return whether an action commanded by ``name`` is running."""
        return any(action.source == f"{self._name} {name}" for action in self.robot.actions.running())

    def stop_speaker(self, name: str) -> None:
        """Stop the motions commanded by ``name``, which is gone. Those of others continue."""
        for action in self.robot.actions.running():
            if action.source == f"{self._name} {name}":
                action.cancel("its client is gone", hard=True)

    def part(self, kind: type[P]) -> P:
        """Return the chapter's state, made on first use."""
        if kind not in self._parts:
            self._parts[kind] = kind(self)
        part: P = self._parts[kind]
        return part

    def at_end(self, what: str, undo: Callable[[], object]) -> None:
        """Call ``undo`` once at the end of the session, no matter how often ``what`` is changed."""
        self._undo[what] = undo

    def _forget_lines(self) -> None:
        """Drop the answers of the last session; members hold the old dict until they join the next one."""
        self.repeated.clear()
        self.repeated = {}

    def join(self, member: Hashable, host: str) -> None:
        """Add ``member`` from ``host``: it keeps the session alive and gets the pushes."""
        self._members[member] = host

    def leave(self, member: Hashable) -> None:
        """Remove ``member``; the last one ends the session."""
        if self._members.pop(member, None) is not None and not self._members:
            self.end("its client is gone", hard=True)

    def send(self, datagram: bytes) -> None:
        """Send a push to every client's host."""
        for host in set(self._members.values()):
            self.outlets.push(datagram, host)
