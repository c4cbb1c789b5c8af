"""Dispatch of a command: finds the operation, checks its parameters, runs it, words the result."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import lru_cache, partial
from inspect import iscoroutinefunction
from types import CoroutineType

from roboglot.model.components.system.network import Network
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.stand_in import StandIn
from roboglot.operations import BadParameters, Operation, Right
from roboglot.protocols.robomaster.answers import Answer, Repeated, Result, Why
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
from roboglot.protocols.robomaster.explain import completed, nearest_command, nearest_values, without_effect
from roboglot.protocols.robomaster.shapes import Shape, shape_of
from roboglot.protocols.robomaster.table import TABLE
from roboglot.values import dataclass
from roboglot.wire.robomaster.commands import Command, Malformed, Value, parse
from roboglot.wire.robomaster.lines import LINE_MAX
from roboglot.wire.robomaster.replies import Profile, Reply

log = logging.getLogger(__name__)

DOOR = "robomaster"
KEPT_MAX = 128  # command lines whose meaning is kept
MANNERS = ("vxy", "vz", "vp", "vy", "wait_for_complete")  # parameters of how to move, not where: alone they do nothing


@dataclass(slots=True)
class _Asked:
    """Command being answered: its key in the contract, and when the tap noted it."""

    key: str = ""
    began: float | None = None


@dataclass(frozen=True, slots=True)
class _Meaning:
    """Parsed line: its number, the command's key ("" if unknown), and its values or their refusal.

    The values must not be changed, as they are cached.
    """

    seq: int | None
    key: str = ""
    values: Mapping[str, object] = field(default_factory=dict)
    refusal: tuple[Reply, Why] | None = None
    warn: Why | None = None  # words in it have no effect


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
        meant = _meant(text, context.active, context.profile.as_robots)
        seq = meant.seq
        if meant.key:
            _enter(context, meant.key, text, asked)
        if meant.refusal is not None:
            raise _Refusal(*meant.refusal)
        result = TABLE[meant.key].handler(context, **meant.values)
        if isinstance(result, CoroutineType):
            result = await result
    except (Malformed, _Refusal) as refusal:
        if refusal.reply is Reply.PARSE_ERROR and not context.active:
            return Answer(context.profile.result(Reply.NOT_IN_SDK_MODE, seq), lambda: "send `command;` first")
        return Answer(context.profile.result(refusal.reply, seq), refusal.why)
    except RobotError as error:
        return _refused(context.profile, error, seq)
    except Exception as error:
        log.exception("robomaster: %r broke", text)
        return _refused(context.profile, error, seq)
    return Answer(_worded(context.profile, result, seq), warn=meant.warn)


def _enter(context: Context, key: str, text: str, asked: _Asked) -> None:
    """Have the tap note a command, and check the client's right. Raises Forbidden."""
    asked.key = key
    if context.robot.tap.watched:
        asked.began = context.robot.tap.request(DOOR, key, text)
    if context.robot.admission.enforced:
        context.robot.admission.check(DOOR, key, TABLE[key].right)
    context.robot.starts.check(TABLE[key].right)


def _refused(profile: Profile, error: Exception, seq: int | None) -> Answer:
    """Word an error of a handler."""
    if isinstance(error, RobotError):
        return Answer(profile.result(reply_to(error), seq), partial(str, error))
    return Answer(profile.result(Reply.FAIL, seq), partial("internal error: {}".format, error))


def _worded(profile: Profile, result: Result, seq: int | None) -> bytes:
    """Word a handler's result."""
    if result is None:
        return profile.result(Reply.OK, seq)
    return profile.result(result, seq) if isinstance(result, str) else profile.values(result, seq)


def at_once(context: Context, text: str) -> Repeated | None:
    """Return a function that answers repetitions of a line in this session; None if that takes more than a plain call.

    The function returns None, without having done anything, if this repetition has to go through ``answer``.
    """
    asked = context.robot
    if not context.active or asked.admission.enforced or asked.stand_in is not None:
        return None
    try:
        meant = _meant(text, context.active, context.profile.as_robots)
    except Malformed:
        return None
    if meant.refusal is not None or iscoroutinefunction(TABLE[meant.key].handler):
        return None
    handler = partial(TABLE[meant.key].handler, context, **meant.values)
    tap, profile, seq = asked.tap, context.profile, meant.seq
    network = asked[Network] if Network in asked else None  # noqa: SIM401 - one that comes later is real and on time

    def reply() -> bytes | Answer | None:
        if tap.watched or asked.starts.down or (network is not None and network.delay):
            return None
        try:
            result = handler()
        except RobotError as error:
            return _refused(profile, error, seq)
        except Exception as error:
            log.exception("robomaster: %r broke", text)
            return _refused(profile, error, seq)
        return _worded(profile, result, seq)

    return reply


async def _stood_in(context: Context, stand_in: StandIn, text: str | None, asked: _Asked) -> Answer:
    """Return the stand-in's answer."""
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
    if context.robot.admission.enforced:
        context.robot.admission.check(DOOR, asked.key, operation.right if operation else Right.ADMIN)
    try:
        reads = text.rstrip(" ;").endswith("?")
        async for reply in stand_in.answer(DOOR, asked.key, text.encode(), reads=reads):
            return Answer(reply.payload, None if reply.status == "ok" else partial(str, reply.status))
    except NotFound as unknown:
        raise _Refusal(Reply.FAIL, partial(str, str(unknown))) from None
    raise _Refusal(Reply.FAIL, lambda: "the recording ends before it was answered")


@lru_cache(KEPT_MAX)
def _meant(text: str, active: bool, as_robots: bool) -> _Meaning:
    """Parse a line, with a cache, as clients repeat few lines. Raises Malformed."""
    command = parse(text)
    for key, words in command.keys:
        operation = TABLE.get(key)
        if operation is not None and (active or key in OUTSIDE_SDK_MODE):
            try:
                values, shape = _checked(operation, words, as_robots), shape_of(operation, as_robots)
                warn = partial(without_effect, shape, ignored) if (ignored := shape.ignored(words)) else None
                return _Meaning(command.seq, key, values, warn=warn)
            except _Refusal as refusal:
                return _Meaning(command.seq, key, refusal=(refusal.reply, refusal.why))
    return _Meaning(command.seq, refusal=(Reply.PARSE_ERROR, partial(_unknown, command)))


def _checked(operation: Operation[str], words: Sequence[str], as_robots: bool) -> Mapping[str, object]:
    """Return the handler's parameters."""
    shape = shape_of(operation, as_robots)
    values = _values(operation.key, shape, words)
    try:
        return shape.check(values)
    except BadParameters as error:
        why = str(error)
        raise _Refusal(Reply.FAIL, lambda: nearest_values(operation.key, shape, values) or why) from None


def _unknown(command: Command) -> str:
    near = nearest_command(command, [operation.key for operation in TABLE])
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
    effective = [name for name in shape.kinds if name not in MANNERS]
    if len(shape.kinds) > 1 and values.keys().isdisjoint(effective):
        raise _Refusal(
            Reply.PARSE_ERROR,
            lambda: f"it takes at least one of {', '.join(effective)}; {completed(key, shape, values)}",
        )
    return values
