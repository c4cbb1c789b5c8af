"""Dispatch of a command: finds its operation, checks its parameters, runs its handler, formats the reply."""

from __future__ import annotations

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from functools import lru_cache, partial
from inspect import iscoroutinefunction
from typing import cast

from roboglot.model.components.system.link import Link
from roboglot.model.components.system.network import Network
from roboglot.model.errors import NotFound, RobotError
from roboglot.model.responder import Responder
from roboglot.operations import BadParameters, Operation, Right
from roboglot.protocols.robomaster.answers import Answer, FastPath, Result, Why
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
PARSED_MAX = 128  # cached command lines
MODIFIERS = ("vxy", "vz", "vp", "vy", "wait_for_complete")  # they say how to move, not where: alone they have no effect


@dataclass(slots=True)
class _Request:
    """A command that is being answered: its key in the contract, and the time at which the tap noted it."""

    key: str = ""
    began: float | None = None


@dataclass(frozen=True, slots=True)
class _ParsedLine:
    """A parsed line: sequence number, key of the command ("" if unknown), and its values or the refusal.

    It is cached, so the values must not be changed.
    """

    seq: int | None
    key: str = ""
    values: Mapping[str, object] = field(default_factory=dict)
    refusal: tuple[Reply, Why] | None = None
    warn: Why | None = None  # which of its words have no effect


class _Refusal(Exception):
    """A command is refused with a fixed reply, for a reason."""

    def __init__(self, reply: Reply, why: Callable[[], str]) -> None:
        super().__init__(reply)
        self.reply = reply
        self.why = why


async def answer(context: Context, text: str | None) -> Answer:
    """Run one command (None: it was too long) and return its answer; raises only CancelledError."""
    request, tap = _Request(), context.robot.tap
    responder = context.robot.responder
    if responder is None:
        result = await _run(context, text, request)
    else:
        result = await _run_on_responder(context, responder, text, request)
    if tap.watched:
        if request.began is None:  # refused before it was parsed
            request.began = tap.request(DOOR, request.key, text or "")
        reply = result.reply
        status = reply.decode("utf-8", "replace").rstrip(" ;") if result.explain else "ok"
        tap.reply(DOOR, request.key, reply, status, result.why, request.began)
    return result


async def _run(context: Context, text: str | None, request: _Request) -> Answer:
    seq = None
    try:
        if text is None:
            raise _Refusal(Reply.PARSE_ERROR, lambda: f"longer than {LINE_MAX} bytes")
        line = _parse_line(text, context.active, context.profile.as_robots)
        seq = line.seq
        if line.key:
            _admit(context, line.key, text, request)
        if line.refusal is not None:
            raise _Refusal(*line.refusal)
        result = cast(Result, await TABLE[line.key].run(context, line.values))
    except (Malformed, _Refusal) as refusal:
        if refusal.reply is Reply.PARSE_ERROR and not context.active:
            return Answer(context.profile.result(Reply.NOT_IN_SDK_MODE, seq), lambda: "send `command;` first")
        return Answer(context.profile.result(refusal.reply, seq), refusal.why)
    except RobotError as error:
        return _format_error(context.profile, error, seq)
    except Exception as error:
        log.exception("robomaster: %r crashed", text)
        return _format_error(context.profile, error, seq)
    return Answer(_format_result(context.profile, result, seq), warn=line.warn)


def _admit(context: Context, key: str, text: str, request: _Request) -> None:
    """Note a command for the tap, and check the client's right. Raises Forbidden, NotReady."""
    request.key = key
    if context.robot.tap.watched:
        request.began = context.robot.tap.request(DOOR, key, text)
    if context.robot.admission.enforced:
        context.robot.admission.check(DOOR, key, TABLE[key].right)
    context.robot.starts.check(TABLE[key].right)


def _format_error(profile: Profile, error: Exception, seq: int | None) -> Answer:
    """Return the answer to a command whose handler raised ``error``."""
    if isinstance(error, RobotError):
        return Answer(profile.result(reply_to(error), seq), partial(str, error))
    return Answer(profile.result(Reply.FAIL, seq), partial("internal error: {}".format, error))


def _format_result(profile: Profile, result: Result, seq: int | None) -> bytes:
    """Return the bytes of a handler's result."""
    if result is None:
        return profile.result(Reply.OK, seq)
    return profile.result(result, seq) if isinstance(result, str) else profile.values(result, seq)


def fast_path(context: Context, text: str) -> FastPath | None:
    """Return a function that answers a line when this session repeats it; None if that takes more than a plain call.

    The function returns None, with no effect, if the repeated line must go through ``answer``.
    """
    this_robot = context.robot
    if not context.active or this_robot.admission.enforced or this_robot.responder is not None:
        return None
    try:
        line = _parse_line(text, context.active, context.profile.as_robots)
    except Malformed:
        return None
    if line.refusal is not None or iscoroutinefunction(TABLE[line.key].handler):
        return None
    if Link in this_robot and TABLE[line.key].right is not Right.SEE:
        return None  # the real robot has to confirm it
    handler = partial(TABLE[line.key].handler, context, **line.values)
    tap, profile, seq = this_robot.tap, context.profile, line.seq
    network = this_robot[Network] if Network in this_robot else None  # noqa: SIM401 - a later one is real

    def reply() -> bytes | Answer | None:
        if tap.watched or this_robot.starts.down or (network is not None and network.delay):
            return None
        try:
            result = handler()
        except RobotError as error:
            return _format_error(profile, error, seq)
        except Exception as error:
            log.exception("robomaster: %r crashed", text)
            return _format_error(profile, error, seq)
        return _format_result(profile, result, seq)

    return reply


async def _run_on_responder(context: Context, responder: Responder, text: str | None, request: _Request) -> Answer:
    """Parse a line and return the responder's answer to it."""
    seq = None
    try:
        if text is None:
            raise _Refusal(Reply.PARSE_ERROR, lambda: f"longer than {LINE_MAX} bytes")
        command = parse(text)
        seq = command.seq
        return await _ask_responder(context, responder, command, text, request)
    except (Malformed, _Refusal) as refusal:
        return Answer(context.profile.result(refusal.reply, seq), refusal.why)
    except RobotError as error:
        return Answer(context.profile.result(reply_to(error), seq), partial(str, error))


async def _ask_responder(
    context: Context, responder: Responder, command: Command, text: str, request: _Request
) -> Answer:
    """Return the responder's first answer. Raises _Refusal without one."""
    operation = next((found for key, _ in command.keys if (found := TABLE.get(key))), None)
    request.key = operation.key if operation else ""
    if context.robot.tap.watched:
        request.began = context.robot.tap.request(DOOR, request.key, text)
    if context.robot.admission.enforced:
        context.robot.admission.check(DOOR, request.key, operation.right if operation else Right.ADMIN)
    try:
        async for reply in responder.answer(DOOR, request.key, text.encode(), reads=command.query):
            return Answer(reply.payload, None if reply.status == "ok" else partial(str, reply.status))
    except NotFound as unknown:
        raise _Refusal(Reply.FAIL, partial(str, str(unknown))) from None
    raise _Refusal(Reply.FAIL, lambda: "the recording ends before it was answered")


@lru_cache(PARSED_MAX)
def _parse_line(text: str, active: bool, as_robots: bool) -> _ParsedLine:
    """Parse a line and check its values; cached, since clients repeat few lines. Raises Malformed."""
    command = parse(text)
    for key, words in command.keys:
        operation = TABLE.get(key)
        if operation is not None and (active or key in OUTSIDE_SDK_MODE):
            try:
                values, shape = _check_values(operation, words, as_robots), shape_of(operation, as_robots)
                warn = partial(without_effect, shape, ignored) if (ignored := shape.ignored(words)) else None
                return _ParsedLine(command.seq, key, values, warn=warn)
            except _Refusal as refusal:
                return _ParsedLine(command.seq, key, refusal=(refusal.reply, refusal.why))
    return _ParsedLine(command.seq, refusal=(Reply.PARSE_ERROR, partial(_unknown, command)))


def _check_values(operation: Operation[str], words: Sequence[str], as_robots: bool) -> Mapping[str, object]:
    """Return the values of the handler's parameters. Raises _Refusal."""
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
    """Return the values by name. Raises _Refusal; a command that lacks words is answered like an unknown one."""
    values = shape.values(words)
    if words and not values and key.endswith((" push", " event")):
        raise _Refusal(
            Reply.FAIL,
            lambda: f"{words[0]!r} can't be switched, only {', '.join(shape.kinds)}; {completed(key, shape, {})}",
        )
    if missing := [name for name in shape.required if name not in values]:
        raise _Refusal(Reply.PARSE_ERROR, lambda: f"{', '.join(missing)} missing; {completed(key, shape, values)}")
    effective = [name for name in shape.kinds if name not in MODIFIERS]
    if len(shape.kinds) > 1 and values.keys().isdisjoint(effective):
        raise _Refusal(
            Reply.PARSE_ERROR,
            lambda: f"it takes at least one of {', '.join(effective)}; {completed(key, shape, values)}",
        )
    return values
