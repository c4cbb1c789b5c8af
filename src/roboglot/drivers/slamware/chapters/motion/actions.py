"""Runs actions of the robot as actions of the model: feedback, pause, cancellation and errors.

An action goes on without a link, as the robot keeps itself safe. If it still runs when the link is back, it is stopped,
because its model action has ended.
"""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable, Iterable

import msgspec

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import RunningAction, SlamwareClient, SlamwareRefused
from roboglot.drivers.slamware.vocabulary import failure, robot_errors
from roboglot.model.actions import Action
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.system.link import Link
from roboglot.model.errors import Busy
from roboglot.model.robot import Robot
from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.motion import ActionInfo, Result, State

PERIOD = 0.1  # s between two polls
ORPHANS_MAX = 64

Feedback = Callable[[ActionInfo], Awaitable[object]]


@dataclass(frozen=True, slots=True)
class VendorAction:
    """An action in the vendor's words, and the function that converts its feedback to the model's."""

    name: str
    options: msgspec.Struct | None
    feedback: Feedback


class ActionRunner:
    """Actions of one robot."""

    def __init__(self, robot: Robot, client: SlamwareClient, link: Link) -> None:
        self._robot, self._client, self._link = robot, client, link
        self._ours: list[int] = []  # the robot's ids of our actions, the latest last
        self.beginning = 0  # our actions that still lack an id
        self.moving = 0  # our actions by which the robot moves itself
        self._orphan: RunningAction | None = None
        self._unanswered = ""  # the name of an action whose reply was lost: it may have begun

    def is_ours(self, id: int) -> bool:
        """Return True if we began that action of the robot."""
        return id in self._ours

    async def begin(self, name: str, options: msgspec.Struct | None) -> RunningAction:
        """Start an action on the robot."""
        self.beginning += 1
        try:
            begun = await self._client.begin(name, options)
            self._ours = [*self._ours[-ORPHANS_MAX:], begun.id]
            return begun
        except SlamwareRefused:
            raise
        except ClientError:
            self._unanswered = name
            raise
        finally:
            self.beginning -= 1

    async def stop_others(self) -> None:
        """Abort the current action of any client; it counts as ours while the robot brakes. Raises RobotError."""
        with robot_errors():
            try:
                now = await self._client.get_current_action()
            except SlamwareRefused:  # no action runs
                return
            self._ours = [*self._ours[-ORPHANS_MAX:], now.action_id]
            await self._client.abort_current_action()

    async def taken_over(self) -> bool:
        """Return True if the robot runs an action of another client."""
        try:
            return not self.is_ours((await self._client.get_current_action()).action_id)
        except SlamwareRefused:  # no action runs
            return False

    def start(
        self, name: str, wanted: VendorAction, *, goal: object, source: str, resources: Iterable[str] = (BASE,)
    ) -> Action:
        """Start an action. Raises Unconnected without a link, Busy while another client moves the robot."""
        self._link.require_free()
        held = {*resources}

        async def run(action: Action) -> None:
            self.moving += BASE in held
            try:
                with robot_errors():
                    while not await self._follow(
                        action, await self.begin(wanted.name, wanted.options), wanted.feedback
                    ):
                        await action.hold(lambda: None)  # paused: start again on resume
            finally:
                self.moving -= BASE in held

        return self._robot.actions.start(name, run, resources=held, goal=goal, source=source, pausable=True)

    async def _follow(self, action: Action, running: RunningAction, feedback: Feedback) -> bool:
        """Follow the action; return True when it has ended, False when it is paused."""
        ended = False
        try:
            while not action.paused:
                self._link.require()
                state = await running.look()
                if state.status is State.DONE:
                    ended = True
                    break
                action.report(await feedback(running.info))
                await self._robot.clock.sleep(PERIOD)
        finally:
            if not ended:
                await self._stop(running)
        if ended and state.result is Result.ABORTED:
            raise Busy(state.reason or "another client of the robot took over")
        if ended and state.result is Result.FAILED:
            raise failure(state)
        return ended

    async def _stop(self, running: RunningAction) -> None:
        """Cancel the action and wait for the stop; without a link, leave it to ``stop_orphan``."""
        try:
            if await running.cancel():
                while (await running.look()).status is not State.DONE:
                    await self._robot.clock.sleep(PERIOD)
        except ClientError:
            self._orphan = running

    async def stop_orphan(self) -> None:
        """Stop the orphaned action after a reconnection. A restarted robot numbers its actions from the start."""
        orphan, self._orphan = self._orphan, None
        unanswered, self._unanswered = self._unanswered, ""
        ours, self._ours = self._ours, []
        with contextlib.suppress(ClientError):
            if orphan is not None:
                self._ours = [orphan.id]  # until it has braked
                await orphan.cancel()
            elif unanswered:
                now = await self._client.get_current_action()
                if now.action_name.endswith(f".{unanswered}") and now.action_id not in ours:
                    self._ours = [now.action_id]
                    await self._client.abort_current_action()
