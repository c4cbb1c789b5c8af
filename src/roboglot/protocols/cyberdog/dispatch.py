"""Dispatch of a request to its answers: reads, calls the handler, reports errors in-band. Knows no gRPC."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping

from msgspec import Struct

from roboglot.model.errors import ComponentMissing, RobotError
from roboglot.model.lateness import lateness
from roboglot.model.stand_in import StandIn
from roboglot.model.tap import SILENT
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters import programming  # noqa: F401
from roboglot.protocols.cyberdog.chapters.camera import camera, video  # noqa: F401
from roboglot.protocols.cyberdog.chapters.mapping import labels, tasks  # noqa: F401
from roboglot.protocols.cyberdog.chapters.motion import motion, stairs  # noqa: F401

# Chapters register their handlers and pushes on import.
from roboglot.protocols.cyberdog.chapters.people import audio, faces, members  # noqa: F401
from roboglot.protocols.cyberdog.chapters.system import (  # noqa: F401
    bluetooth,
    ota,
    settings,
    skin,
    status,
    upkeep,
)
from roboglot.protocols.cyberdog.errors import RecordedEnd, codes_of
from roboglot.protocols.cyberdog.table import TABLE, unread
from roboglot.transport.log_limiter import LogLimiter
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import SILENT_WITHOUT_SERVICE, TEXT_ONLY, UNPUBLISHED, UNUSED, InBandError
from roboglot.wire.cyberdog.text import NotJson, fitting, mismatches, read_params, unknown_names, write

log = logging.getLogger(__name__)
seldom = LogLimiter(log)
DOOR = "cyberdog"
_NAMES = {int(row.key): row.name for row in contract("cyberdog")}
KNOWN = (_NAMES.keys() | UNPUBLISHED) - TEXT_ONLY


def error(code: InBandError) -> dict[str, int]:
    """Return the answer that carries ``code``."""
    return {"error_code": int(code)}


async def answer(call: Call) -> object | None:
    """Run the request; return its last answer, or None. Raises NotJson, and nothing else."""
    robot = call.context.robot
    if robot.tap.watched:
        last = await _noted(call)
    else:
        last = await (_answered(call) if robot.stand_in is None else _stood_in(call, robot.stand_in))
    if delay := lateness(robot):
        await robot.clock.sleep(delay)
    return last


async def _noted(call: Call) -> object | None:
    """Run the request, and note it and its outcome for subscribers of the tap."""
    robot = call.context.robot
    tap, key = robot.tap, str(int(call.code))
    began = call.began = tap.request(DOOR, key, call.text)
    try:
        last = await (_answered(call) if robot.stand_in is None else _stood_in(call, robot.stand_in))
    except NotJson as bad:
        answered = error(InBandError.BAD_PARAMETERS)
        tap.reply(DOOR, key, write(answered), _status(answered), str(bad), began)
        raise
    except RecordedEnd as end:
        tap.reply(DOOR, key, "", end.status, "the recorded robot ended the call so", began)
        raise
    if last is not None or call.why:
        text, status = ("", SILENT) if last is None else (write(last), _status(last))
        tap.reply(DOOR, key, text, status, call.why, began)
    return last


async def _stood_in(call: Call, stand_in: StandIn) -> object | None:
    """Return the last answer of the robot's stand-in."""
    try:
        return await _ask_stand_in(call, stand_in)
    except RobotError as refused:
        call.why = str(refused)
        log.info("%d refused: %s", call.code, refused)
        return error(InBandError.UNAVAILABLE)


async def _ask_stand_in(call: Call, stand_in: StandIn) -> object | None:
    """Let the stand-in answer; send all but the last answer."""
    operation = TABLE.get(call.code)
    if call.context.robot.admission.enforced:
        call.context.robot.admission.check(DOOR, str(int(call.code)), operation.right if operation else Right.ADMIN)
    reads = operation is not None and operation.right is Right.SEE
    async for reply in stand_in.answer(DOOR, str(int(call.code)), call.text.encode(), reads=reads):
        RecordedEnd.check(reply.status)
        if reply.status == SILENT:
            call.why = "the recorded robot said nothing, either"
            return None
        text = reply.payload.decode("utf-8", "replace")
        if reply.last:
            return text
        await call.reply(text)
    return None


async def _answered(call: Call) -> object | None:
    operation, admission = TABLE.get(call.code), call.context.robot.admission
    wrong: list[str] = []
    try:
        if operation is not None and admission.enforced:
            admission.check(DOOR, str(int(call.code)), operation.right)
        if operation is not None:
            call.context.robot.starts.check(operation.right)
        values = {} if call.code in unread else read_params(call.text)
        if operation is None:
            call.why = "no robot of this program does that"
            return _not_there(call.code)
        if values and operation.names:
            values, wrong = _taken(call, values, operation.parameters)
        return _logged(call, await operation.call(call, values))
    except BadParameters as bad:
        call.why = "; ".join(wrong) or str(bad)
        log.info("%d refused: %s", call.code, call.why)
        return error(InBandError.BAD_PARAMETERS)
    except RobotError as refused:
        call.why = str(refused)
        log.info("%d refused: %s", call.code, refused)
        if isinstance(refused, ComponentMissing) and call.code in SILENT_WITHOUT_SERVICE:
            return None
        return error(codes_of(refused).in_band)
    except NotJson:
        raise
    except Exception as broken:
        call.why = f"internal error: {broken}"
        log.exception("%d broke", call.code)
        return error(InBandError.UNAVAILABLE)


def _taken(call: Call, values: Mapping[str, object], fields: type[Struct]) -> tuple[Mapping[str, object], list[str]]:
    """Return the valid values, and what is wrong with the others; logs the latter and unknown names."""
    taken, wrong = fitting(values, fields), []
    if len(taken) < len(values):
        wrong = mismatches(values, fields)
        unknown = unknown_names(values, fields, UNUSED.get(call.code, frozenset()))
        if ignored := "; ".join([*wrong, *unknown]):
            seldom.warning(f"{call.code} {ignored}", "%d: ignored: %s", call.code, ignored)
    return taken, wrong


def _logged(call: Call, last: object) -> object:
    """Log the reason if the answer is a refusal, which may carry it; return the answer."""
    if not call.why and isinstance(last, dict) and last.get("success") is False:
        call.why = str(last.get("message", ""))
    if call.why:
        log.info("%d refused: %s", call.code, call.why)
    return last


def _status(answered: object) -> str:
    """Return the error code of an answer; "ok" without one."""
    if isinstance(answered, str) and '"error_code"' in answered:
        with contextlib.suppress(NotJson):
            answered = read_params(answered)
    code = answered.get("error_code", 0) if isinstance(answered, dict) else 0
    return f"error_code {code}" if code else "ok"


def _not_there(code: int) -> dict[str, int] | None:
    """Answer as a real robot whose service for ``code`` is not running; unknown codes get no answer at all."""
    if code not in KNOWN:
        log.info("code %d is not supported", code)
        return None
    log.warning("code %d (%s) is not supported", code, _NAMES.get(code, "not in the text"))
    return None if code in SILENT_WITHOUT_SERVICE else error(InBandError.UNAVAILABLE)
