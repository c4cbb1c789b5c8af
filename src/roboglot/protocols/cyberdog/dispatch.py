"""Dispatch of a request: reads its parameters, calls its handler, reports errors in-band. Knows no gRPC."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Mapping

from msgspec import Struct

from roboglot.model.errors import ComponentMissing, RobotError
from roboglot.model.responder import Responder
from roboglot.model.response_delay import response_delay
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
from roboglot.wire.cyberdog.codes import (
    SILENT_WITHOUT_SERVICE,
    TEXT_ONLY,
    UNPUBLISHED,
    UNUSED,
    WITH_FIELDS,
    InBandError,
)
from roboglot.wire.cyberdog.text import (
    NotJson,
    fitting,
    mismatches,
    read_json,
    read_params,
    unknown_names,
    why_unknown,
    write,
)

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)
DOOR = "cyberdog"
_NAMES = {int(row.key): row.name for row in contract("cyberdog")}
KNOWN = (_NAMES.keys() | UNPUBLISHED) - TEXT_ONLY


def error(code: InBandError) -> dict[str, int]:
    """Return an answer with this error code."""
    return {"error_code": int(code)}


async def answer(call: Call) -> object | None:
    """Run the request; return its last answer, or None. Raises NotJson, and nothing else."""
    robot = call.context.robot
    if robot.tap.watched:
        last = await _run_and_note(call)
    else:
        last = await (_run(call) if robot.responder is None else _run_on_responder(call, robot.responder))
    if delay := response_delay(robot):
        await robot.clock.sleep(delay)
    return last


async def _run_and_note(call: Call) -> object | None:
    """Run the request; note it and its outcome for subscribers of the tap."""
    robot = call.context.robot
    tap, key = robot.tap, str(int(call.code))
    began = call.began = tap.request(DOOR, key, call.text)
    try:
        last = await (_run(call) if robot.responder is None else _run_on_responder(call, robot.responder))
    except NotJson as bad:
        answered = error(InBandError.BAD_PARAMETERS)
        tap.reply(DOOR, key, write(answered), _status(answered), str(bad), began)
        raise
    except RecordedEnd as end:
        tap.reply(DOOR, key, "", end.status, "the recorded robot ended the call with this status", began)
        raise
    if last is not None or call.why:
        text, status = ("", SILENT) if last is None else (write(last), _status(last))
        tap.reply(DOOR, key, text, status, call.why, began)
    return last


async def _run_on_responder(call: Call, responder: Responder) -> object | None:
    """Return the last answer of the robot's responder."""
    try:
        return await _ask_responder(call, responder)
    except RobotError as refused:
        call.why = str(refused)
        log.info("%d refused: %s", call.code, refused)
        return error(InBandError.UNAVAILABLE)


async def _ask_responder(call: Call, responder: Responder) -> object | None:
    """Let the responder answer; send all but the last answer."""
    operation = TABLE.get(call.code)
    if call.context.robot.admission.enforced:
        call.context.robot.admission.check(DOOR, str(int(call.code)), operation.right if operation else Right.ADMIN)
    reads = operation is not None and operation.right is Right.SEE
    async for reply in responder.answer(DOOR, str(int(call.code)), call.text.encode(), reads=reads):
        RecordedEnd.check(reply.status)
        if reply.status == SILENT:
            call.why = "the recorded robot gave no answer either"
            return None
        text = reply.payload.decode("utf-8", "replace")
        if reply.last:
            return text
        await call.reply(text)
    return None


async def _run(call: Call) -> object | None:
    operation, admission = TABLE.get(call.code), call.context.robot.admission
    wrong: list[str] = []
    try:
        if operation is not None and admission.enforced:
            admission.check(DOOR, str(int(call.code)), operation.right)
        if operation is not None:
            call.context.robot.starts.check(operation.right)
        values = _fields_of(call)
        if operation is None:
            call.why = "this operation is not implemented"
            return _answer_unsupported(call.code)
        if values and operation.names:
            values, wrong = _valid_values(call, values, operation.parameters)
        return _log_refusal(call, await operation.call(call, values))
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
    except Exception as failure:
        call.why = f"internal error: {failure}"
        log.exception("%d crashed", call.code)
        return error(InBandError.UNAVAILABLE)


def _fields_of(call: Call) -> Mapping[str, object]:
    """Return the fields of a request. Raises NotJson, and BadParameters where none would do more than was asked."""
    if call.code in unread:
        return {}
    if call.code in WITH_FIELDS and not isinstance(read_json(call.text), dict):
        raise BadParameters("the parameters must be an object")
    return read_params(call.text)


def _valid_values(
    call: Call, values: Mapping[str, object], fields: type[Struct]
) -> tuple[Mapping[str, object], list[str]]:
    """Return the valid values, and why the others are invalid; log the reasons and unknown names.

    Raises BadParameters where no name is known, and none would do more than was asked.
    """
    valid, wrong = fitting(values, fields), []
    if len(valid) < len(values):
        wrong = mismatches(values, fields)
        unknown = unknown_names(values, fields, UNUSED.get(call.code, frozenset()))
        reasons = [why_unknown(name, near) for name, near in unknown.items()]
        if call.code in WITH_FIELDS and values.keys().isdisjoint(fields.__struct_fields__):
            raise BadParameters("; ".join(reasons))
        meant = zip(unknown.values(), reasons, strict=True)
        call.misspelt = {near: why for near, why in meant if near and near not in values}
        if ignored := "; ".join([*wrong, *reasons]):
            limited_log.warning(f"{call.code} {ignored}", "%d: ignored: %s", call.code, ignored)
    return valid, wrong


def _log_refusal(call: Call, last: object) -> object:
    """Log the reason if the answer is a refusal; return the answer."""
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


def _answer_unsupported(code: int) -> dict[str, int] | None:
    """Answer like a real robot whose service for ``code`` is not running; there is no answer to unknown codes."""
    if code not in KNOWN:
        log.info("code %d is not supported", code)
        return None
    log.warning("code %d (%s) is not supported", code, _NAMES.get(code, "not in the manual"))
    return None if code in SILENT_WITHOUT_SERVICE else error(InBandError.UNAVAILABLE)
