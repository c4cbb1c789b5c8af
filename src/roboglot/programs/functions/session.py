"""View of a function on the run that calls it: the robot, time and actions that pause, blocks and the log.

Knows no process and no store: its ``host`` does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable
from typing import Protocol, TypeVar, cast

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.errors import Busy
from roboglot.model.events import ActionChanged
from roboglot.model.robot import Robot
from roboglot.programs.functions.results import state
from roboglot.programs.worker.values import Record

SLEEP_MAX = 9.2e9  # s, as in CPython


class TaskEnded(Exception):
    """The program asked to end here; nothing after the call runs."""


class Host(Protocol):
    """The run that a session belongs to."""

    def begin_block(self, id: str) -> None:
        """End the block before and begin this one."""

    async def breakpoint(self) -> None:
        """Suspend the task here; returns when it is suspended."""

    def write(self, level: str, text: str) -> None:
        """Add to the program's log."""


class SessionState(Protocol):
    """Something that a group keeps between a program's calls: lights it holds, a recogniser that is on."""

    def __init__(self, session: Session) -> None: ...

    def close(self) -> None:
        """The program is over."""


P = TypeVar("P", bound=SessionState)


class Session:
    """One running program's hold on the robot. Everything it starts carries ``source``, so that it can be ended."""

    def __init__(self, robot: Robot, task: str, host: Host) -> None:
        self.robot = robot
        self.task = task
        self.host = host
        self.source = f"visual:{task}"
        self.states: dict[str, Record] = {}  # by group: the result of its last call
        self.logging: set[str] = set()  # groups whose calls go to the log
        self.last_state = state()  # of the last call, for the block's frames
        self._parts: dict[type[SessionState], SessionState] = {}
        self._going_on = asyncio.Event()
        self._going_on.set()
        self._paused = asyncio.Event()

    def pause(self) -> None:
        """Hold the program's actions and waits."""
        self._going_on.clear()
        self._paused.set()
        for action in self._actions():
            action.pause()

    def resume(self) -> None:
        """Go on with them."""
        self._paused.clear()
        self._going_on.set()
        for action in self._actions():
            action.resume()

    def cancel(self, reason: str) -> None:
        """Call off everything that the program started, and let go what it holds; the robot brakes by itself."""
        for action in self._actions():
            action.cancel(reason)
        while self._parts:
            self._parts.popitem()[1].close()

    def part(self, kind: type[P]) -> P:
        """The program's own one of this kind, made when first asked for and closed with the program."""
        if kind not in self._parts:
            self._parts[kind] = kind(self)
        return cast(P, self._parts[kind])

    async def unpaused(self) -> None:
        """A pause may come between a call and its answer: the answer waits."""
        await self._going_on.wait()

    async def sleep(self, seconds: float) -> None:
        """Let robot time pass; paused time does not count."""
        clock, left = self.robot.clock, seconds
        while left > 1e-9:
            await self._going_on.wait()
            start = clock.time()
            await _either(clock.sleep(left), self._paused.wait())
            left -= clock.time() - start

    async def complete(self, action: Action) -> None:
        """Wait until ``action`` has succeeded; raises its error, or Busy if it was cancelled."""
        try:
            await action.succeeded()
        finally:
            action.cancel("the program goes on without it")

    async def hold(self, action: Action, seconds: float) -> None:
        """Let ``action`` execute for ``seconds`` of robot time (pauses and getting ready do not count), then end it.

        Raises its error, or Busy, if it ended before.
        """
        try:
            await _either(self._executing(action), action.done())
            await _either(self.sleep(seconds), action.done())
            if action.status.ended and action.status is not ActionStatus.SUCCEEDED:
                raise action.error.again() if action.error else Busy(f"{action.name} was cancelled")
        finally:
            action.cancel()
        await action.done()

    def _actions(self) -> list[Action]:
        return [action for action in self.robot.actions.running() if action.source == self.source]

    async def _executing(self, action: Action) -> None:
        with self.robot.events.subscribe(ActionChanged) as changes:
            while action.status is ActionStatus.ACCEPTED:
                await changes.next()


async def _either(*waits: Awaitable[object]) -> None:
    """Wait for the first of these and cancel the others."""
    tasks = [asyncio.ensure_future(wait) for wait in waits]
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
    finally:
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)


def usable_seconds(seconds: float) -> float:
    """``seconds`` if they can be waited for, or ValueError in Python's words."""
    if not seconds >= 0:
        raise ValueError("sleep length must be non-negative")
    if seconds > SLEEP_MAX:
        raise OverflowError("timestamp too large to convert to C _PyTime_t")
    return seconds
