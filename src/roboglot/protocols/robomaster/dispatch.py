"""From a command's text to its answer: finds the operation, checks its parameters, runs it, words the result."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass

from msgspec.structs import fields

from roboglot.model.errors import RobotError
from roboglot.operations import BadParameters, Operation
from roboglot.protocols.robomaster import chassis, robot, sdk  # noqa: F401 - importing them fills the table
from roboglot.protocols.robomaster.errors import reply_to
from roboglot.protocols.robomaster.sdk import OUTSIDE_SDK_MODE
from roboglot.protocols.robomaster.session import Session
from roboglot.protocols.robomaster.table import TABLE
from roboglot.wire.contracts import contract
from roboglot.wire.robomaster.commands import Command, Malformed, Value, parameters_of, parse
from roboglot.wire.robomaster.lines import LINE_MAX
from roboglot.wire.robomaster.replies import Number, Reply

log = logging.getLogger(__name__)

SENT = "> "  # how the contract marks what the robot sends by itself
MESSAGES = frozenset({"> chassis push", "> robot ip"})  # those that this door really sends
COMMANDS = {row.key: row.chapter for row in contract("robomaster") if not row.key.startswith(SENT)}
COMMANDS["sensor_adapter pulse_period"] = "sensor adapter"  # the manual prints this query without its `?`


@dataclass(frozen=True, slots=True)
class Answer:
    """The bytes for the client and, if it was refused, why, in plain words for the log."""

    reply: bytes
    why: str = ""


class _Refusal(Exception):
    """Anything that isn't done: the fixed answer, and why."""

    def __init__(self, reply: Reply, why: str) -> None:
        super().__init__(why)
        self.reply = reply


def implemented() -> set[str]:
    """The contract's keys that this door serves wholly, commands and messages."""
    return {row.key for row in contract("robomaster")} & (
        {operation.key for operation in TABLE if not operation.partial} | MESSAGES
    )


def partly() -> dict[str, str]:
    """Keys that are there in part, with what they cannot do yet."""
    return {operation.key: operation.partial for operation in TABLE if operation.partial}


async def answer(session: Session, text: str | None) -> Answer:
    """Run one command (None: it was too long to be kept) and word its answer; never raises but when cancelled."""
    seq = None
    try:
        if text is None:
            raise _Refusal(Reply.PARSE_ERROR, f"longer than {LINE_MAX} bytes")
        command = parse(text)
        seq = command.seq
        result = await _run(session, command)
    except (Malformed, _Refusal) as refusal:
        if refusal.reply is Reply.PARSE_ERROR and not session.active:
            return Answer(session.profile.result(Reply.NOT_IN_SDK_MODE, seq), "send `command;` first")
        return Answer(session.profile.result(refusal.reply, seq), str(refusal))
    except RobotError as error:
        return Answer(session.profile.result(reply_to(error), seq), str(error))
    except Exception as error:
        log.exception("robomaster: %r broke", text)
        return Answer(session.profile.result(Reply.FAIL, seq), f"internal error: {error}")
    match result:
        case None:
            return Answer(session.profile.result(Reply.OK, seq))
        case Reply():
            return Answer(session.profile.result(result, seq))
        case _:
            return Answer(session.profile.values(result, seq))


async def _run(session: Session, command: Command) -> Reply | Sequence[Number | str] | None:
    operation, words = _find(session, command)
    values = _values(operation, words)
    try:
        result: Reply | Sequence[Number | str] | None = await operation.call(session, values)
    except BadParameters as error:
        raise _Refusal(Reply.FAIL, str(error)) from None
    return result


def _find(session: Session, command: Command) -> tuple[Operation[str], Sequence[str]]:
    """The operation that is meant and the words left for its parameters."""
    for key, words in command.keys:
        if not session.active and key not in OUTSIDE_SDK_MODE:
            continue
        if operation := TABLE.get(key):
            return operation, words
        if key in COMMANDS:
            raise _Refusal(Reply.FAIL, f"this robot's {COMMANDS[key]} commands aren't there yet")
    raise _Refusal(Reply.PARSE_ERROR, "no such command")


def _values(operation: Operation[str], words: Sequence[str]) -> dict[str, Value]:
    """The values by name; a command whose words are missing is answered like an unknown one."""
    values = parameters_of(words, operation.names)
    missing = [field.name for field in fields(operation.parameters) if field.required and field.name not in values]
    if missing:
        raise _Refusal(Reply.PARSE_ERROR, f"{', '.join(missing)} missing")
    if len(operation.names) > 1 and not values:
        raise _Refusal(Reply.PARSE_ERROR, f"it takes at least one of {', '.join(operation.names)}")
    return values
