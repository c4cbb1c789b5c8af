"""Actions: things that take time. One executing action per resource; who may interrupt whom is decided here.

The words are ROS 2's: a goal is accepted, executes, may be paused (ours), is cancelled, succeeds or aborts.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections import deque
from collections.abc import Awaitable, Callable, Iterable
from enum import Enum, IntEnum

from roboglot.model.client_context import client, connection, identity
from roboglot.model.clock import Clock
from roboglot.model.errors import Busy, NotFound, RobotError, forget_stack
from roboglot.model.events import ActionChanged, EventStream

log = logging.getLogger(__name__)
HISTORY_MAX = 20


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
        """True if nothing more will happen."""
        return self >= ActionStatus.SUCCEEDED


class OnBusy(Enum):
    """What a new action does when another one holds its resource."""

    REPLACE = "replace"
    REFUSE = "refuse"


class Action:
    """One goal under way or ended. Made by ``Actions.start``."""

    def __init__(
        self, owner: Actions, id: int, name: str, goal: object, resources: frozenset[str], source: str
    ) -> None:
        self.id = id
        self.name = name
        self.goal = goal
        self.resources = resources
        self.source = source  # who asked for it, e.g. the door's name; for the log and for what ends with its client
        self.client = client()  # the very one, as its door names it
        self.connection = connection()  # over which it was asked; empty: over none that is known
        self.identity = identity()  # who it showed to be, where that is asked
        self.status = ActionStatus.ACCEPTED
        self.feedback: object = None
        self.error: RobotError | None = None
        self.paused = False
        self.hands_over = False  # what takes its place goes on from its motion: it need not stand still first
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
        """Why it ended short of success, in plain words; empty on success."""
        return str(self.error) if self.error else ""

    async def done(self) -> ActionStatus:
        """Wait for the end and say how it ended (never raises for the action's own failure)."""
        await self._ended.wait()
        return self.status

    async def succeeded(self) -> None:
        """Wait for the end; raise the action's error, or ``Busy`` if it was cancelled."""
        if await self.done() is not ActionStatus.SUCCEEDED:
            raise self.error.again() if self.error else Busy(f"{self.name} was cancelled")

    def cancel(self, reason: str = "") -> None:
        """Ask it to stop; it ends CANCELED as soon as it has braked. Nothing happens if it has ended."""
        if self.status.ended or self.status is ActionStatus.CANCELING:
            return
        self.error = Busy(reason) if reason else None
        self._move_to(ActionStatus.CANCELING)
        if self._task:
            self._task.cancel()

    def abort(self, error: RobotError) -> None:
        """Stop it as ``cancel`` does, but end it ABORTED with ``error``: for what protects the robot.

        Nothing happens if it has ended or is being cancelled.
        """
        if self.status.ended or self.status is ActionStatus.CANCELING:
            return
        self.error = self._failure = error
        self._move_to(ActionStatus.CANCELING)
        if self._task:
            self._task.cancel()

    def pause(self) -> None:
        """Hold where it is until ``resume``."""
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
        """True if a new wish of ``source`` can be met by this action: the same client asks, and it still runs."""
        going = self.status in (ActionStatus.ACCEPTED, ActionStatus.EXECUTING)
        return going and (self.source, self.client) == (source, client())

    def report(self, feedback: object) -> None:
        """For the action's own code: publish progress; the same feedback twice in a row is published once."""
        if feedback != self.feedback:
            self.feedback = feedback
            self._owner.announce(self)

    async def hold(self, brake: Callable[[], object]) -> bool:
        """For the action's own loop: if paused, brake and wait for ``resume``. True if it had been paused."""
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


class Actions:
    """The robot's actions: those under way, and the last 20 ended ones."""

    def __init__(self, clock: Clock, events: EventStream) -> None:
        self.clock = clock
        self._events = events
        self._ids = itertools.count(1)
        self._running: dict[int, Action] = {}
        self._history: deque[Action] = deque(maxlen=HISTORY_MAX)
        self._admit: Callable[[Action], None] = lambda _: None

    def guard(self, admit: Callable[[Action], None]) -> None:
        """Ask ``admit`` before an action is accepted; it raises RobotError if that may not be."""
        self._admit = admit

    def start(
        self,
        name: str,
        run: Callable[[Action], Awaitable[None]],
        *,
        resources: Iterable[str],
        goal: object = None,
        source: str = "",
        on_busy: OnBusy = OnBusy.REPLACE,
        after: Action | None = None,
    ) -> Action:
        """Accept a goal and execute ``run(action)`` once its resources are free.

        ``run`` ends by returning (SUCCEEDED), raising RobotError (ABORTED) or being cancelled (CANCELED); it must leave
        the hardware still in every case. With ``OnBusy.REPLACE`` the holder of a resource is cancelled first; with
        ``REFUSE`` this raises ``Busy``. ``after`` is no rival: it is let end before this one begins (standing up, then
        driving).
        """
        action = Action(self, next(self._ids), name, goal, frozenset(resources), source)
        self._admit(action)
        rivals = [o for o in self._running.values() if o.resources & action.resources and o is not after]
        if rivals and on_busy is OnBusy.REFUSE:
            raise Busy(f"{rivals[0].name} is under way")
        for rival in rivals:
            rival.cancel(f"{name} took over")
        self._running[action.id] = action
        self.announce(action)
        action._task = asyncio.get_running_loop().create_task(
            _execute(action, run, [*rivals, after] if after else rivals), name=f"action {name}"
        )
        action._task.add_done_callback(lambda task: self._finish(action, task))
        return action

    def _finish(self, action: Action, task: asyncio.Task[None]) -> None:
        """Record how the task ended; in a callback, because a task cancelled before its first step runs no code."""
        error = action._failure or (None if task.cancelled() else task.exception())
        match error:
            case None if task.cancelled():
                status = ActionStatus.CANCELED
            case None:
                action.error, status = None, ActionStatus.SUCCEEDED
            case RobotError():
                action.error, status = error, ActionStatus.ABORTED
                log.info("%s #%d failed: %s", action.name, action.id, error)
            case _:
                action.error, status = RobotError(f"internal error: {error}"), ActionStatus.ABORTED
                log.error("%s #%d broke", action.name, action.id, exc_info=error)
        forget_stack(error)  # it is kept for a while; what it ran through must not be
        action._task = None
        del self._running[action.id]
        self._history.append(action)
        action._move_to(status)

    def announce(self, action: Action) -> None:
        """Publish that something about ``action`` changed."""
        self._events.publish(ActionChanged(stamp=self.clock.time(), action=action))

    def running(self, resource: str | None = None) -> list[Action]:
        """Those not ended, oldest first; only those that hold ``resource`` if given."""
        return [a for a in self._running.values() if resource is None or resource in a.resources]

    def get(self, id: int) -> Action:
        """A running one or one of the last 20, or NotFound."""
        if id in self._running:
            return self._running[id]
        for action in self._history:
            if action.id == id:
                return action
        raise NotFound(f"no action {id}")

    @property
    def history(self) -> list[Action]:
        """The last ended actions, oldest first."""
        return list(self._history)

    async def cancel(self, *, resource: str | None = None, source: str | None = None, reason: str = "") -> None:
        """Cancel all, or what holds ``resource``, or what ``source`` asked for; returns when it stands still."""
        doomed = [a for a in self.running(resource) if source is None or a.source == source]
        for action in doomed:
            action.cancel(reason)
        for action in doomed:
            await action.done()


async def _execute(action: Action, run: Callable[[Action], Awaitable[None]], before: list[Action]) -> None:
    """Wait until those that have to give way stand still, and what must come first is over; then run."""
    for other in before:
        await other.done()
    action._move_to(ActionStatus.EXECUTING)
    await run(action)
