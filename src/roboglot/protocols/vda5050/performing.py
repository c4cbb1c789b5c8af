"""Execution of actions of orders and instant actions, with their states, errors and retries."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Mapping
from contextvars import ContextVar
from typing import TYPE_CHECKING, Protocol

from roboglot.model.components.motion.driving import BASE
from roboglot.model.errors import RobotError
from roboglot.operations import BadParameters, Operation
from roboglot.protocols.vda5050.error_book import ErrorBook
from roboglot.protocols.vda5050.errors import Rejected
from roboglot.protocols.vda5050.order_book import ActionState, ActionStatus
from roboglot.spelling import brief, instead
from roboglot.wire.vda5050.versions import ErrorKind, Level

if TYPE_CHECKING:
    from roboglot.model.actions import Action as RobotAction
    from roboglot.model.admission import Right
    from roboglot.model.robot import Robot
    from roboglot.wire.vda5050.versions import Version

log = logging.getLogger(__name__)
WORD_MAX = 60  # characters of an unknown parameter's name in an error
_DOING: ContextVar[ActionState] = ContextVar("doing")  # the action of the present task


class Performing(Protocol):
    """Context of the robot whose actions are performed."""

    robot: Robot
    version: Version
    errors: ErrorBook

    def touch(self) -> None:
        """Schedule a state message."""

    def check(self, operation: str, right: Right | None) -> None:
        """Raise Rejected unless fleet control has the right."""


class Performer:
    """Does one context's actions."""

    def __init__(self, context: Performing) -> None:
        self._context = context
        self._asked: dict[str, asyncio.Future[bool]] = {}  # actions in RETRIABLE: True to try again
        self._parts: dict[RobotAction, ActionState] = {}  # what the robot does for actions and can pause
        self._paused = False

    def pause(self, on: bool) -> None:
        """Pause or continue what the robot does. Raises Refused if it moves and cannot stand still."""
        for part, state in self._parts.items():
            _hold(part, state, on)
        self._paused = on

    async def carry_out(self, part: RobotAction) -> None:
        """Wait until the robot's part of an action has succeeded, paused with the order; cancelled if the wait is."""
        state = self._parts[part] = _DOING.get()
        try:
            _hold(part, state, self._paused)
            await part.succeeded()
        finally:
            del self._parts[part]
            part.cancel("fleet control cancelled it")
            await part.done()

    async def perform(self, state: ActionState, operation: Operation[str], *, instant: bool = False) -> None:
        """Perform ``state``'s action to its end; a retriable one waits for instructions after a failure."""
        may_wait = state.action.retriable and self._context.version.new_words
        await self._try(state, operation, instant)
        while may_wait and state.status is ActionStatus.FAILED:
            if not await self._wanted_again(state):
                return
            self._context.errors.forget_action(state.action.action_id)
            await self._try(state, operation, instant)

    def answer(self, action_id: str, *, again: bool) -> None:
        """Try an action in RETRIABLE again, or let it fail. Raises Rejected if none waits."""
        asked = self._asked.get(action_id)
        if asked is None or asked.done():
            why = f"no action {action_id} waits to be retried"
            raise Rejected(ErrorKind.INSTANT_ACTION, why, {"actionId": action_id})
        asked.set_result(again)

    async def _wanted_again(self, state: ActionState) -> bool:
        key = state.action.action_id
        asked = self._asked[key] = asyncio.get_running_loop().create_future()
        state.status = ActionStatus.RETRIABLE
        self._context.touch()
        try:
            return bool(await asked)
        finally:
            self._asked.pop(key, None)
            state.status = ActionStatus.FAILED
            self._context.touch()

    async def _try(self, state: ActionState, operation: Operation[str], instant: bool) -> None:
        context, action = self._context, state.action
        state.status = ActionStatus.RUNNING
        _DOING.set(state)
        context.touch()
        try:
            context.check(operation.key, operation.right)
            if lacking := [kind.__name__ for kind in operation.needs if kind not in context.robot]:
                raise Rejected(ErrorKind.INSTANT_ACTION, f"this robot has no {lacking[0]}")
            _check_known(operation, action.values)
            state.result = await operation.call(context, action.values) or ""
            state.status = ActionStatus.FINISHED
        except asyncio.CancelledError:
            state.status, state.result = ActionStatus.FAILED, "it was cancelled"
            raise
        except Rejected as rejected:
            state.status, state.result = ActionStatus.FAILED, str(rejected)
            references = {**rejected.references, "actionId": action.action_id}
            own = instant and rejected.kind is ErrorKind.INSTANT_ACTION  # those leave with the next instant actions
            context.errors.report(rejected.kind, rejected.level, str(rejected), references, order=not own)
        except (RobotError, BadParameters, ValueError) as error:
            state.status, state.result = ActionStatus.FAILED, str(error)
            kind = ErrorKind.INSTANT_ACTION if instant else ErrorKind.ACTION_FAILED
            context.errors.report(kind, Level.WARNING, str(error), {"actionId": action.action_id}, order=not instant)
        except Exception as error:
            log.exception("robot %s: the action %s crashed", context.robot.id, action.action_type)
            state.status, state.result = ActionStatus.FAILED, f"internal error: {error}"
            why = f"internal error in {action.action_type}: {error}"
            context.errors.report(ErrorKind.ACTION_FAILED, Level.WARNING, why, {"actionId": action.action_id})
        finally:
            context.touch()


def _check_known(operation: Operation[str], values: Mapping[str, object]) -> None:
    """Raise BadParameters if no parameter that was sent is known: the action would do another thing than was asked."""
    known = operation.parameters.__struct_encode_fields__
    if values and known and values.keys().isdisjoint(known):
        word = next(iter(values))
        raise BadParameters(f"{brief(word, WORD_MAX)} is unknown{instead(word, known)}")


def _hold(part: RobotAction, state: ActionState, on: bool) -> None:
    """Pause or continue a part; one that cannot be paused goes on, as long as it does not drive. Raises Refused."""
    if on and (part.pausable or BASE in part.resources):
        part.pause()
        state.status = ActionStatus.PAUSED
    else:
        part.resume()
        state.status = ActionStatus.RUNNING
