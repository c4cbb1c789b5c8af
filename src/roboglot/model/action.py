"""One action: a goal in progress or ended, and its outcome. Knows neither the robot nor its other actions.

The words are ROS 2's: a goal is accepted, executes, may be paused (ours), is cancelled, succeeds or aborts.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from enum import IntEnum
from typing import Protocol

from roboglot.model.client_context import client, connection, identity
from roboglot.model.clock import Clock
from roboglot.model.errors import Busy, Refused, RobotError


class ActionStatus(IntEnum):
    """ROS 2 action_msgs/GoalStatus."""

    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @property
    def ended(self) -> bool:
        """True once the action has ended, however it ended."""
        return self >= ActionStatus.SUCCEEDED


class Announcer(Protocol):
    """The owner of actions (``Actions``), which publishes every change of one."""

    clock: Clock

    def announce(self, action: Action, /) -> None:
        """Publish a change of ``action``."""


class Action:
    """One goal in progress or ended. Created by ``Actions.start``."""

    def __init__(
        self,
        owner: Announcer,
        id: int,
        name: str,
        goal: object,
        resources: frozenset[str],
        source: str,
        *,
        pausable: bool = False,
    ) -> None:
        self.id = id
        self.name = name
        self.goal = goal
        self.resources = resources
        self.source = source  # the requester, e.g. the door's name; for the log, and to end actions with their client
        self.client = client()  # the individual client, as its door names it
        self.connection = connection()  # the connection of the request; empty if unknown
        self.identity = identity()  # the identity that the client proved, where one is required
        self.status = ActionStatus.ACCEPTED
        self.feedback: object = None
        self.error: RobotError | None = None
        self.pausable = pausable  # its code stands still in ``hold`` while it is paused
        self.paused = False
        self.hands_over = False  # the next action continues this motion: no stop in between
        self.brakes_hard = False  # cancelled because its client is gone: brake as fast as possible
        self.started_at = self.ended_at = owner.clock.time()
        self._failure: RobotError | None = None  # why it is being aborted from outside
        self._owner = owner
        self._changed = asyncio.Event()
        self._ended = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._going_on = asyncio.Event()
        self._going_on.set()

    @property
    def reason(self) -> str:
        """Reason for ending short of success, in plain words; empty on success."""
        return str(self.error) if self.error else ""

    async def done(self) -> ActionStatus:
        """Wait for the end and return the status; an action's own failure raises nothing."""
        await self._ended.wait()
        return self.status

    async def succeeded(self) -> None:
        """Wait for the end; raise the action's error, or ``Busy`` if it was cancelled."""
        if await self.done() is not ActionStatus.SUCCEEDED:
            raise self.error.again() if self.error else Busy(f"{self.name} was cancelled")

    def cancel(self, reason: str = "", *, hard: bool = False) -> None:
        """Request a stop; the action ends CANCELED once it has braked. No effect if it has ended.

        ``hard``: brake as in an emergency, because the client is lost or may no longer drive.
        """
        if self.status.ended or self.status is ActionStatus.CANCELING:
            return
        self.brakes_hard = hard
        self.error = Busy(reason) if reason else None
        self._move_to(ActionStatus.CANCELING)
        if self._task:
            self._task.cancel()

    def abort(self, error: RobotError) -> None:
        """Stop as ``cancel`` does, but end ABORTED with ``error``: for functions that protect the robot.

        No effect if the action has ended or is being cancelled.
        """
        if self.status.ended or self.status is ActionStatus.CANCELING:
            return
        self.error = self._failure = error
        self._move_to(ActionStatus.CANCELING)
        if self._task:
            self._task.cancel()

    def pause(self) -> None:
        """Hold where it is until ``resume``; no effect if it has ended. Raises Refused if it cannot stand still."""
        if not self.pausable:
            raise Refused(f"{self.name} cannot be paused, only cancelled")
        if not self.status.ended and not self.paused:
            self.paused = True
            self._going_on.clear()
            self._owner.announce(self)

    def resume(self) -> None:
        """Go on after ``pause``."""
        if self.paused:
            self.paused = False
            self._going_on.set()
            self._owner.announce(self)

    def may_go_on(self, source: str) -> bool:
        """True if this action can serve a new request of ``source``: it runs and comes from the same client.

        False as soon as its code has returned, which the status shows only in the loop's next turn.
        """
        going = self.status in (ActionStatus.ACCEPTED, ActionStatus.EXECUTING)
        return going and not (self._task and self._task.done()) and (self.source, self.client) == (source, client())

    def report(self, feedback: object) -> None:
        """Publish progress, from the action's own code; the same feedback twice in a row is published once."""
        if feedback != self.feedback:
            self.feedback = feedback
            self._owner.announce(self)

    async def hold(self, brake: Callable[[], object]) -> bool:
        """Brake and wait for ``resume`` if paused, in the action's own loop. True if it had been paused."""
        if self._going_on.is_set():
            return False
        brake()
        await self._going_on.wait()
        return True

    def _move_to(self, status: ActionStatus) -> None:
        self.status = status
        if status.ended:
            self.ended_at = self._owner.clock.time()
            self.paused = False
            self._ended.set()
        self._owner.announce(self)
