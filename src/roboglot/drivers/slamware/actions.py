"""An action that the robot carries out by itself, as one of the model: its feedback, pause, cancellation and errors.

Such an action goes on when the link is lost: the robot sees to its safety itself. Whatever of ours it still does when
the link is back is stopped, for by then nobody waits for it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Awaitable, Callable, Iterable

import msgspec

from roboglot.clients.errors import ClientError
from roboglot.clients.slamware import RunningAction, SlamwareClient, SlamwareRefused
from roboglot.drivers.slamware.vocabulary import failure, robot_errors
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.system.link import Link
from roboglot.model.errors import Busy
from roboglot.model.robot import Robot
from roboglot.wire.slamware.motion import ActionInfo, Result, State

PERIOD = 0.1  # s between two looks
ORPHANS_MAX = 64

Feedback = Callable[[ActionInfo], Awaitable[object]]


class ActionRunner:
    """Those of one robot."""

    def __init__(self, robot: Robot, client: SlamwareClient, link: Link) -> None:
        self._robot, self._client, self._link = robot, client, link
        self._ours: list[int] = []  # ids that the robot gave our actions, the newest last
        self.beginning = 0  # actions of ours whose ids the robot has not told yet
        self._orphan: RunningAction | None = None
        self._unanswered = ""  # the name of an action that the robot may have begun: its answer was lost

    def is_ours(self, id: int) -> bool:
        """Whether we began that action of the robot."""
        return id in self._ours

    async def begin(self, name: str, options: msgspec.Struct | None) -> RunningAction:
        """Have the robot begin it."""
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
        """End what the robot does, whoever began it; while it brakes it counts as ours. Raises RobotError."""
        with robot_errors():
            try:
                now = await self._client.get_current_action()
            except SlamwareRefused:  # it does nothing
                return
            self._ours = [*self._ours[-ORPHANS_MAX:], now.action_id]
            await self._client.abort_current_action()

    async def taken_over(self) -> bool:
        """Ask the robot whether it does what another client began."""
        try:
            return not self.is_ours((await self._client.get_current_action()).action_id)
        except SlamwareRefused:  # it does nothing
            return False

    def start(
        self,
        name: str,
        vendor_name: str,
        options: msgspec.Struct | None,
        feedback: Feedback,
        *,
        goal: object,
        source: str,
        on_busy: OnBusy,
        resources: Iterable[str] = (BASE,),
    ) -> Action:
        """Start it; Busy as ``on_busy`` has it, Unconnected without a link."""
        self._link.require_free()

        async def run(action: Action) -> None:
            with robot_errors():
                while not await self._follow(action, await self.begin(vendor_name, options), feedback):
                    await action.hold(lambda: None)  # paused: begin again when it goes on

        return self._robot.actions.start(name, run, resources=resources, goal=goal, source=source, on_busy=on_busy)

    async def _follow(self, action: Action, running: RunningAction, feedback: Feedback) -> bool:
        """Until it ends (True) or is paused (False)."""
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
        """And wait until it has braked; if the robot cannot be told, it is when the link is back."""
        try:
            if await running.cancel():
                while (await running.look()).status is not State.DONE:
                    await self._robot.clock.sleep(PERIOD)
        except ClientError:
            self._orphan = running

    async def stop_orphan(self) -> None:
        """The link is back: stop what nobody waits for any more. A robot that was restarted numbers actions anew."""
        orphan, self._orphan = self._orphan, None
        unanswered, self._unanswered = self._unanswered, ""
        ours, self._ours = self._ours, []
        with contextlib.suppress(ClientError):
            if orphan is not None:
                self._ours = [orphan.id]  # as long as it brakes
                await orphan.cancel()
            elif unanswered:
                now = await self._client.get_current_action()
                if now.action_name.endswith(f".{unanswered}") and now.action_id not in ours:
                    self._ours = [now.action_id]
                    await self._client.abort_current_action()
