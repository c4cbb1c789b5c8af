"""A running action of the robot: progress, result and cancellation. Independent of the kind of action."""

from __future__ import annotations

from collections.abc import Callable, Generator
from typing import TYPE_CHECKING

from roboglot.clients.errors import ClientError, LinkLost
from roboglot.clients.slamware.calls import SlamwareRefused
from roboglot.model.clock import Clock
from roboglot.wire.slamware.chapters.motion import ActionInfo, ActionState, Result, State

if TYPE_CHECKING:
    from roboglot.clients.slamware.chapters.motion import Motion

PERIOD = 0.1  # s between two polls
LOST_MAX = 5.0  # s without an answer before waiting fails
GONE = 404


class ActionFailed(ClientError):
    """The action failed; ``state.reason`` is the robot's reason."""

    def __init__(self, name: str, state: ActionState) -> None:
        super().__init__(f"{name}: {state.reason or state.result.name.lower()}")
        self.state = state


class ActionAborted(ActionFailed):
    """The action was stopped: by this client, another one, or a newer action."""


class RunningAction:
    """A running action; awaiting it returns once it has succeeded. Raises ActionFailed or ActionAborted otherwise."""

    def __init__(
        self, motion: Motion, clock: Clock, begun: ActionInfo, on_progress: Callable[[ActionInfo], object] | None
    ) -> None:
        self._motion, self._clock, self._on_progress = motion, clock, on_progress
        self.id, self.name = begun.action_id, begun.action_name
        self.info = begun  # the latest report of the running action
        self.state = begun.state
        self._progress(begun)

    def __await__(self) -> Generator[object, None, None]:
        return self.succeeded().__await__()

    async def succeeded(self) -> None:
        """Wait for success. Raises ActionFailed, ActionAborted, and LinkLost after 5 s without an answer."""
        state = await self.done()
        if state.result is Result.ABORTED:
            raise ActionAborted(self.name, state)
        if state.result is Result.FAILED:
            raise ActionFailed(self.name, state)

    async def done(self) -> ActionState:
        """Wait for the end; return the final state. Raises LinkLost after 5 s without an answer."""
        heard = self._clock.time()
        while True:
            try:
                if (state := await self.look()).status is State.DONE:
                    return state
                heard = self._clock.time()
            except LinkLost:
                if self._clock.time() - heard > LOST_MAX:
                    raise
            await self._clock.sleep(PERIOD)

    async def look(self) -> ActionState:
        """Poll and return the state once."""
        try:
            reply = await self._motion.get_action_result(self.id)
        except SlamwareRefused as refused:
            if refused.code != GONE:
                raise
            self.state = ActionState(State.DONE, Result.ABORTED, "the robot no longer knows it")
            return self.state
        self.state = reply.state
        if reply.action_name and reply.state.status is not State.DONE:
            self._progress(ActionInfo(reply.action_id, reply.action_name, reply.stage, reply.state))
        return self.state

    async def cancel(self) -> bool:
        """Stop the action if it is still the current one, as robots stop no other; return True if it was."""
        try:
            current = await self._motion.get_current_action()
        except SlamwareRefused:
            return False
        if current.action_id != self.id:
            return False
        await self._motion.abort_current_action()
        return True

    def _progress(self, info: ActionInfo) -> None:
        self.info = info
        if self._on_progress is not None:
            self._on_progress(info)
