"""Dispatch of a command: finds the operation, checks its parameters, runs it, words the result."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import lru_cache, partial

from roboglot.model.errors import NotFound, RobotError
from roboglot.model.stand_in import StandIn
from roboglot.operations import BadParameters, Right
from roboglot.protocols.robomaster.chapters import (  # noqa: F401
    ai,
    arm,
    armor,
    blaster,
    camera,
    chassis,
    game,
    gimbal,
    gripper,
    ir_distance,
    led,
    pwm,
    robot,
    sdk,
    sensor_adapter,
    servo,
    sound,
)
from roboglot.protocols.robomaster.chapters.sdk import OUTSIDE_SDK_MODE
from roboglot.protocols.robomaster.context import Context
from roboglot.protocols.robomaster.errors import reply_to
from roboglot.protocols.robomaster.explain import completed, nearest_command, nearest_values
from roboglot.protocols.robomaster.shapes import Shape, shape_of
from roboglot.protocols.robomaster.table import TABLE
from roboglot.values import dataclass
from roboglot.wire.robomaster.commands import Command, Malformed, Value, parse
from roboglot.wire.robomaster.lines import LINE_MAX
from roboglot.wire.robomaster.replies import Number, Reply

log = logging.getLogger(__name__)

DOOR = "robomaster"
KEPT_MAX = 128  # command lines whose meaning is kept


@dataclass(frozen=True, slots=True)
class Answer:
    """Bytes for the client and, of a refusal, the reason in plain words for the log.

    ``explain`` is called only when a listener needs it: the search for the intended command is slow.
    """

    reply: bytes
    explain: Callable[[], str] | None = None

    @property
    def why(self) -> str:
        """Reason of a refusal; empty on success."""
        return self.explain() if self.explain else ""


@dataclass(slots=True)
class _Asked:
    """Command being answered: its key in the contract, and when it was noted for followers."""

    key: str = ""
    began: float | None = None


class _Refusal(Exception):
    """Refusal: the fixed answer, and the reason."""

    def __init__(self, reply: Reply, why: Callable[[], str]) -> None:
        super().__init__(reply)
        self.reply = reply
        self.why = why


async def answer(context: Context, text: str | None) -> Answer:
    """Run one command (None: too long) and word its answer; raises nothing but cancellation."""
    asked, tap = _Asked(), context.robot.tap
    stand_in = context.robot.stand_in
    result = await (_answered(context, text, asked) if stand_in is None else _stood_in(context, stand_in, text, asked))
    if tap.watched:
        if asked.began is None:  # refused before it was parsed
            asked.began = tap.request(DOOR, asked.key, text or "")
        reply = result.reply
        status = reply.decode("utf-8", "replace").rstrip(" ;") if result.explain else "ok"
        tap.reply(DOOR, asked.key, reply, status, result.why, asked.began)
    return result


async def _answered(context: Context, text: str | None, asked: _Asked) -> Answer:
    seq = None
    try:
        if text is None:
            raise _Refusal(Reply.PARSE_ERROR, lambda: f"longer than {LINE_MAX} bytes")
        seq = _parsed(text).seq
        key, _ = _meant(text, context.active)
        operation = TABLE[key]
        asked.key = key
        if context.robot.tap.watched:
            asked.began = context.robot.tap.request(DOOR, key, text)
        if context.robot.admission.asks:
            context.robot.admission.check(DOOR, key, operation.right)
        values = _checked(text, context.active, context.profile.as_robots)
        result: str | Sequence[Number | str] | None = await operation.handler(context, **values)
    except (Malformed, _Refusal) as refusal:
        if refusal.reply is Reply.PARSE_ERROR and not context.active:
            return Answer(context.profile.result(Reply.NOT_IN_SDK_MODE, seq), lambda: "send `command;` first")
        return Answer(context.profile.result(refusal.reply, seq), refusal.why)
    except RobotError as error:
        return Answer(context.profile.result(reply_to(error), seq), partial(str, error))
    except Exception as error:
        log.exception("robomaster: %r broke", text)
        return Answer(context.profile.result(Reply.FAIL, seq), partial("internal error: {}".format, error))
    match result:
        case None:
            return Answer(context.profile.result(Reply.OK, seq))
        case str():  # a Reply, or free text
            return Answer(context.profile.result(result, seq))
        case _:
            return Answer(context.profile.values(result, seq))


async def _stood_in(context: Context, stand_in: StandIn, text: str | None, asked: _Asked) -> Answer:
    """Let the stand-in answer."""
    seq = None
    try:
        if text is None:
            raise _Refusal(Reply.PARSE_ERROR, lambda: f"longer than {LINE_MAX} bytes")
        command = parse(text)
        seq = command.seq
        return await _ask_stand_in(context, stand_in, command, text, asked)
    except (Malformed, _Refusal) as refusal:
        return Answer(context.profile.result(refusal.reply, seq), refusal.why)
    except RobotError as error:
        return Answer(context.profile.result(reply_to(error), seq), partial(str, error))


async def _ask_stand_in(context: Context, stand_in: StandIn, command: Command, text: str, asked: _Asked) -> Answer:
    """Return the stand-in's first answer. Raises _Refusal without one."""
    operation = next((found for key, _ in command.keys if (found := TABLE.get(key))), None)
    asked.key = operation.key if operation else ""
    if context.robot.tap.watched:
        asked.began = context.robot.tap.request(DOOR, asked.key, text)
    if context.robot.admission.asks:
        context.robot.admission.check(DOOR, asked.key, operation.right if operation else Right.ADMIN)
    try:
        reads = text.rstrip(" ;").endswith("?")
        async for reply in stand_in.answer(DOOR, asked.key, text.encode(), reads=reads):
            return Answer(reply.payload, None if reply.status == "ok" else partial(str, reply.status))
    except NotFound as unknown:
        raise _Refusal(Reply.FAIL, partial(str, str(unknown))) from None
    raise _Refusal(Reply.FAIL, lambda: "the recording ends before it was answered")


@lru_cache(KEPT_MAX)
def _parsed(text: str) -> Command:
    """Parse a line. Clients repeat few lines again and again, so results are cached."""
    return parse(text)


@lru_cache(KEPT_MAX)
def _meant(text: str, active: bool) -> tuple[str, Sequence[str]]:
    """Return the key of the command, in SDK mode or outside of it, and the words of its parameters."""
    command = _parsed(text)
    for key, words in command.keys:
        if not active and key not in OUTSIDE_SDK_MODE:
            continue
        if key in TABLE:
            return key, words
    raise _Refusal(Reply.PARSE_ERROR, partial(_unknown, command))


@lru_cache(KEPT_MAX)
def _checked(text: str, active: bool, as_robots: bool) -> Mapping[str, object]:
    """Return the handler's parameters; read only, as they are cached."""
    key, words = _meant(text, active)
    shape = shape_of(TABLE[key], as_robots)
    values = _values(key, shape, words)
    try:
        return shape.check(values)
    except BadParameters as error:
        why = str(error)
        raise _Refusal(Reply.FAIL, lambda: nearest_values(key, shape, values) or why) from None


def _unknown(command: Command) -> str:
    near = nearest_command(command, (operation.key for operation in TABLE))
    return f"no such command; {near}" if near else "no such command"


def _values(key: str, shape: Shape, words: Sequence[str]) -> dict[str, Value]:
    """Return the values by name; a command with missing words is answered like an unknown one."""
    values = shape.values(words)
    if words and not values and key.endswith((" push", " event")):
        raise _Refusal(
            Reply.FAIL,
            lambda: f"{words[0]!r} can't be switched, only {', '.join(shape.kinds)}; {completed(key, shape, {})}",
        )
    if missing := [name for name in shape.required if name not in values]:
        raise _Refusal(Reply.PARSE_ERROR, lambda: f"{', '.join(missing)} missing; {completed(key, shape, values)}")
    if not values and len(shape.kinds) > 1:
        raise _Refusal(
            Reply.PARSE_ERROR,
            lambda: f"it takes at least one of {', '.join(shape.kinds)}; {completed(key, shape, {})}",
        )
    return values
