"""Actions: one executing action per resource, and the rules of preemption.

The words are ROS 2's: a goal is accepted, executes, may be paused (ours), is cancelled, succeeds or aborts.
"""

from __future__ import annotations

import asyncio
import itertools
import logging
from collections import deque
from collections.abc import Awaitable, Callable, Iterable

from roboglot.model.action import Action, ActionStatus
from roboglot.model.clock import Clock
from roboglot.model.errors import NotFound, RobotError, forget_stack
from roboglot.model.events import ActionChanged, EventStream

__all__ = ["Action", "ActionStatus", "Actions"]

log = logging.getLogger(__name__)
HISTORY_MAX = 20


class Actions:
    """The robot's actions: those under way, and the last 20 ended ones."""

    def __init__(self, clock: Clock, events: EventStream) -> None:
        self.clock = clock
        self._events = events
        self._ids = itertools.count(1)
        self._running: dict[int, Action] = {}
        self._history: deque[Action] = deque(maxlen=HISTORY_MAX)
        self._guards: list[Callable[[Action], None]] = []

    def guard(self, admit: Callable[[Action], None]) -> None:
        """Call ``admit`` before an action is accepted; it raises RobotError to refuse the action."""
        self._guards.append(admit)

    def start(
        self,
        name: str,
        run: Callable[[Action], Awaitable[None]],
        *,
        resources: Iterable[str],
        goal: object = None,
        source: str = "",
        after: Action | None = None,
        pausable: bool = False,
    ) -> Action:
        """Accept a goal and execute ``run(action)`` once its resources are free.

        ``run`` ends by returning (SUCCEEDED), raising RobotError (ABORTED) or being cancelled (CANCELED); it must leave
        the hardware at rest in every case. Holders of the resources are cancelled first, except ``after``, which may
        finish before this action begins (standing up, then driving). ``pausable``: ``run`` looks at ``action.hold``, so
        that a pause stops the robot; all other actions refuse one.
        """
        action = Action(self, next(self._ids), name, goal, frozenset(resources), source, pausable=pausable)
        for admit in self._guards:
            admit(action)
        rivals = [o for o in self._running.values() if o.resources & action.resources and o is not after]
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
                log.error("%s #%d crashed", action.name, action.id, exc_info=error)
        forget_stack(error)  # the error is kept for a while; its stack frames must not be
        action._task = None
        del self._running[action.id]
        self._history.append(action)
        action._move_to(status)

    def announce(self, action: Action) -> None:
        """Publish a change of ``action``."""
        self._events.publish(ActionChanged(stamp=self.clock.time(), action=action))

    def running(self, resource: str | None = None) -> list[Action]:
        """Return actions under way, oldest first; with ``resource``, only those that hold it."""
        return [a for a in self._running.values() if resource is None or resource in a.resources]

    def get(self, id: int) -> Action:
        """Return a running action or one of the last 20 ended ones. Raises NotFound."""
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
        """Cancel all, those that hold ``resource``, or those of ``source``; return when the robot stands."""
        doomed = [a for a in self.running(resource) if source is None or a.source == source]
        for action in doomed:
            action.cancel(reason)
        for action in doomed:
            await action.done()


async def _execute(action: Action, run: Callable[[Action], Awaitable[None]], before: list[Action]) -> None:
    """Wait for preempted actions to stand still and for ``before`` to end; then run."""
    for other in before:
        await other.done()
    action._move_to(ActionStatus.EXECUTING)
    await run(action)
