"""From one request to its answers: reads, calls the handler, tells errors in-band. Knows no gRPC."""

from __future__ import annotations

import logging

from roboglot.model.components.network import lateness
from roboglot.model.errors import ComponentMissing, RobotError
from roboglot.operations import BadParameters

# The chapters register their handlers and pushes when they are imported.
from roboglot.protocols.cyberdog import (  # noqa: F401
    audio,
    bluetooth,
    camera,
    faces,
    labels,
    members,
    motion,
    ota,
    programming,
    settings,
    skin,
    stairs,
    status,
    tasks,
    update_jobs,
    upkeep,
    video,
)
from roboglot.protocols.cyberdog.errors import told
from roboglot.protocols.cyberdog.table import Call, operations, unread
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import SILENT_WITHOUT_SERVICE, TEXT_ONLY, UNPUBLISHED, InBandError
from roboglot.wire.cyberdog.text import NotJson, fitting, read_params

log = logging.getLogger(__name__)
_NAMES = {int(row.key): row.name for row in contract("cyberdog")}
KNOWN = (_NAMES.keys() | UNPUBLISHED) - TEXT_ONLY


def error(code: InBandError) -> dict[str, int]:
    """The answer that tells ``code``."""
    return {"error_code": int(code)}


async def answer(call: Call) -> object | None:
    """Run the request; returns its last answer (None: there is none). Raises NotJson, and nothing else."""
    last = await _answered(call)
    if delay := lateness(call.dog.robot):
        await call.dog.robot.clock.sleep(delay)
    return last


async def _answered(call: Call) -> object | None:
    values = {} if call.code in unread else read_params(call.text)
    operation = operations.get(call.code)
    if operation is None:
        return _not_there(call.code)
    try:
        if values and operation.names:
            values = fitting(values, operation.parameters)
        last: object = await operation.call(call, values)
        return last
    except BadParameters as bad:
        log.info("%d: %s", call.code, bad)
        return error(InBandError.BAD_PARAMETERS)
    except RobotError as refused:
        log.info("%d: %s", call.code, refused)
        if isinstance(refused, ComponentMissing) and call.code in SILENT_WITHOUT_SERVICE:
            return None
        return error(told(refused).in_band)
    except NotJson:
        raise
    except Exception:
        log.exception("%d broke", call.code)
        return error(InBandError.UNAVAILABLE)


def _not_there(code: int) -> dict[str, int] | None:
    """As a real robot answers whose service for ``code`` is not running; unknown codes get no answer at all."""
    if code not in KNOWN:
        log.info("nobody knows code %d", code)
        return None
    log.warning("%d (%s): no robot of this program does that; it is refused", code, _NAMES.get(code, "not in the text"))
    return None if code in SILENT_WITHOUT_SERVICE else error(InBandError.UNAVAILABLE)
