"""Errands: sequences of the robot's own actions, such as a drive and then docking, or a search and then a turn.

An errand is an action of the model like any other; not it but its parts hold the base. Another action that takes
the base from a part ends the errand. Knows no wire format.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Coroutine

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.system.lease import ERRAND
from roboglot.model.errors import Expired, RobotError
from roboglot.model.events import ActionChanged
from roboglot.model.robot import Robot

SOURCE = "slamware"  # of every action requested by clients of this door
PART = "slamware part"  # of actions that an errand requests; invisible to clients


class Errand:
    """An errand under way."""

    def __init__(self, robot: Robot, action: Action) -> None:
        self.robot = robot
        self._action = action

    async def do(
        self, part: Action, *, within: float | None = None, watch: Coroutine[object, None, RobotError] | None = None
    ) -> None:
        """Wait for ``part``, report it as the errand's progress, and raise its error.

        The errand can be paused as long as its part can, and a part that begins during a pause is paused, too. After
        ``within`` s the part is cancelled, with Expired; when ``watch`` returns, with its error. If another client
        cancels it, so is the errand.
        """
        self._action.report(part)
        self._action.pausable = part.pausable
        if not part.pausable:
            self._action.resume()  # the pause of an earlier part cannot last
        elif self._action.paused:
            part.pause()
        stop = self.robot.events.listen(ActionChanged, lambda event: self._pass_on(event, part))
        try:
            if within is None:
                problem = await _end_of(part, watch)
            else:
                problem = await self.robot.clock.wait_for(_end_of(part, watch), within)
        except TimeoutError:
            problem = Expired(f"{part.name} took longer than {within:g} s")
        except asyncio.CancelledError:
            part.cancel(self._action.reason)
            if self._action.status is ActionStatus.CANCELING:  # otherwise the loop is closing and no clock moves
                await part.done()
            raise
        finally:
            stop()
            self._action.pausable = True  # what comes between two parts stands still
        if problem is not None:
            part.cancel(str(problem))
            await part.done()
            raise problem
        if part.status is ActionStatus.CANCELED:
            self._action.cancel(part.reason)
            raise asyncio.CancelledError
        if part.error is not None:
            raise part.error.again()

    def _pass_on(self, event: ActionChanged, part: Action) -> None:
        """Pause and resume the part with the errand."""
        if event.action is self._action and part.paused is not self._action.paused:
            (part.pause if self._action.paused else part.resume)()


async def _end_of(part: Action, watch: Coroutine[object, None, RobotError] | None) -> RobotError | None:
    """Return at the end of ``part``, or when ``watch`` returns an error: with that."""
    if watch is None:
        await part.done()
        return None
    tasks = asyncio.ensure_future(part.done()), asyncio.ensure_future(watch)
    try:
        await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        return None if tasks[0].done() else tasks[1].result()
    finally:
        for task in tasks:
            task.cancel()


def run_errand(
    robot: Robot, name: str, work: Callable[[Errand], Awaitable[None]], goal: object = None, *, source: str = SOURCE
) -> Action:
    """Start ``work`` in place of the current errand; an error of ``work`` aborts the action."""

    async def run(action: Action) -> None:
        await work(Errand(robot, action))

    return robot.actions.start(name, run, resources={ERRAND}, goal=goal, source=source, pausable=True)


def part_of(action: Action) -> Action:
    """Return the current part of an errand, or any other action itself."""
    return action.feedback if isinstance(action.feedback, Action) else action
