"""A run as seen by its functions: the robot, sleeps and actions that pause, blocks and the log.

Knows no process and no store; its ``host`` does.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import Protocol, TypeVar, cast

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.errors import Busy, RobotError
from roboglot.model.events import ActionChanged
from roboglot.model.robot import Robot
from roboglot.programs.functions.results import state
from roboglot.programs.worker.values import Record

log = logging.getLogger(__name__)
SLEEP_MAX = 9.2e9  # s, as in CPython


class TaskEnded(Exception):
    """End of the program by its own request; no code after the call runs."""


class Host(Protocol):
    """The run that a session belongs to."""

    def begin_block(self, id: str) -> None:
        """End the open block and begin this one."""

    async def breakpoint(self) -> None:
        """Suspend the task after the current call."""

    def write(self, level: str, text: str) -> None:
        """Add to the program's log."""


class SessionState(Protocol):
    """State of a group between a program's calls, such as held lights or an active recogniser."""

    def __init__(self, session: Session) -> None: ...

    def close(self) -> None:
        """Release everything at the end of the program."""


P = TypeVar("P", bound=SessionState)


class Session:
    """One running program's access to the robot. All its actions carry ``source``, so that they can be ended."""

    def __init__(self, robot: Robot, task: str, host: Host) -> None:
        self.robot = robot
        self.task = task
        self.host = host
        self.source = f"visual:{task}"
        self.states: dict[str, Record] = {}  # by group: state of its last call
        self.logging: set[str] = set()  # groups whose calls go to the log
        self.last_state = state()  # of the last call, for reports of blocks
        self.ended = False  # a call that is still under way begins nothing more
        self._parts: dict[type[SessionState], SessionState] = {}
        self._going_on = asyncio.Event()
        self._going_on.set()
        self._paused = asyncio.Event()
        self._end_watch: Callable[[], None] = _nothing  # of actions that begin during a pause
        self._pauses = 0.0  # s, of robot time
        self._paused_at = 0.0

    @property
    def awake(self) -> float:
        """Robot time that stands still during the program's pauses, s: for times after which a call gives up."""
        return (self.robot.clock.time() if self._going_on.is_set() else self._paused_at) - self._pauses

    def pause(self) -> None:
        """Pause the program's actions and waits, and actions that a call with several begins during the pause.

        An action that cannot be paused, such as an announcement, goes on to its end.
        """
        if self._going_on.is_set():
            self._paused_at = self.robot.clock.time()
        self._going_on.clear()
        self._paused.set()
        for action in self._actions():
            if action.pausable:
                action.pause()
        self._end_watch()
        self._end_watch = self.robot.events.listen(ActionChanged, self._pause_new)

    def resume(self) -> None:
        """Continue the program's actions and waits."""
        self._end_watch()
        if not self._going_on.is_set():
            self._pauses += self.robot.clock.time() - self._paused_at
        self._paused.clear()
        self._going_on.set()
        for action in self._actions():
            action.resume()

    def cancel(self, reason: str) -> None:
        """End the program's use of the robot: cancel its actions and release its holds. Raises nothing.

        The robot brakes by itself.
        """
        self.ended = True
        self._end_watch()
        for action in self._actions():
            action.cancel(reason)
        while self._parts:
            kind, part = self._parts.popitem()
            try:
                part.close()
            except RobotError as error:  # a real robot that is out of reach: the other parts are closed all the same
                log.info("%s: cannot close %s: %s", self.source, kind.__name__, error)

    def part(self, kind: type[P]) -> P:
        """Return the program's state of this kind, made on first use and closed with the program."""
        if kind not in self._parts:
            self._parts[kind] = kind(self)
        return cast(P, self._parts[kind])

    async def unpaused(self) -> None:
        """Wait until the program is not paused, as a pause may come between a call and its answer."""
        await self._going_on.wait()

    async def sleep(self, seconds: float) -> None:
        """Wait for ``seconds`` of robot time; pauses do not count."""
        clock, left = self.robot.clock, seconds
        while left > 1e-9:
            await self._going_on.wait()
            start = clock.time()
            await _either(clock.sleep(left), self._paused.wait())
            left -= clock.time() - start

    async def complete(self, action: Action) -> None:
        """Wait until ``action`` has succeeded. Raises its error, or Busy if it was cancelled."""
        try:
            await action.succeeded()
        finally:
            action.cancel("the program goes on without it")

    async def hold(self, action: Action, seconds: float) -> None:
        """Let ``action`` execute for ``seconds`` of robot time (pauses and preparation do not count), then cancel it.

        Raises its error, or Busy, if it failed or was cancelled before.
        """
        try:
            await _either(self._executing(action), action.done())
            await _either(self.sleep(seconds), action.done())
            if action.status.ended and action.status is not ActionStatus.SUCCEEDED:
                raise action.error.again() if action.error else Busy(f"{action.name} was cancelled")
        finally:
            action.cancel()
        await action.done()

    def _pause_new(self, event: ActionChanged) -> None:
        action = event.action
        if action.source == self.source and action.status is ActionStatus.ACCEPTED and action.pausable:
            action.pause()

    def _actions(self) -> list[Action]:
        return [action for action in self.robot.actions.running() if action.source == self.source]

    async def _executing(self, action: Action) -> None:
        with self.robot.events.subscribe(ActionChanged) as changes:
            while action.status is ActionStatus.ACCEPTED:
                await changes.next()


def _nothing() -> None:
    """Do nothing: nothing is watched."""


async def _either(*waits: Awaitable[object]) -> None:
    """Wait for the first to complete and cancel the others."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def usable_seconds(seconds: float) -> float:
    """Return ``seconds`` if valid for a sleep. Raises ValueError or OverflowError with CPython's texts."""
    if not seconds >= 0:
        raise ValueError("sleep length must be non-negative")
    if seconds > SLEEP_MAX:
        raise OverflowError("timestamp too large to convert to C _PyTime_t")
    return seconds
