"""The SDK session: one per robot, begun by ``command``, shared by every control connection that uses it.

It ends with ``quit`` or with its last connection; then the robot stops what the session commanded and every setting
goes back. Knows no sockets: connections are whatever joins and leaves.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable

from roboglot.model.actions import Action
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.pushes import Pushes
from roboglot.protocols.robomaster.vocabulary import Mode
from roboglot.wire.robomaster.replies import Profile


class Session:
    """What the commands of all connections share; ``send`` gets a datagram and the client's host."""

    def __init__(self, robot: Robot, profile: Profile, send: Callable[[bytes, str], None]) -> None:
        self.robot = robot
        self.profile = profile
        self.active = False
        self.mode = Mode.CHASSIS_LEAD
        self.source = ""  # of the actions it starts; each session has its own
        self.pushes = Pushes(robot, profile, self._push)
        self._send = send
        self._members: dict[Hashable, str] = {}
        self._numbers = itertools.count(1)

    def begin(self) -> None:
        """Enter SDK mode with everything at its default."""
        self.active = True
        self.source = f"robomaster#{next(self._numbers)}"

    def end(self, reason: str) -> list[Action]:
        """Leave SDK mode; returns the actions that were told to stop and may still be braking."""
        stopping = [action for action in self.robot.actions.running() if self.active and action.source == self.source]
        for action in stopping:
            action.cancel(reason)
        self.active = False
        self.mode = Mode.CHASSIS_LEAD
        self.pushes.reset()
        self._members.clear()
        return stopping

    def join(self, member: Hashable, host: str) -> None:
        """``member`` uses the session from ``host``: it keeps the session alive and gets the pushes."""
        self._members[member] = host

    def leave(self, member: Hashable) -> None:
        """``member`` is gone; the last one ends the session."""
        if self._members.pop(member, None) is not None and not self._members:
            self.end("its client is gone")

    def _push(self, datagram: bytes) -> None:
        for host in set(self._members.values()):
            self._send(datagram, host)
