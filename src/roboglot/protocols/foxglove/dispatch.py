"""Dispatch of a message: reads, finds the handler, checks the right, reports errors. Never raises."""

from __future__ import annotations

import logging

from roboglot.model.errors import RobotError
from roboglot.operations import BadParameters, Right
from roboglot.protocols.foxglove.chapters import parameters, playback, publishing, topics  # noqa: F401 - they fill the table
from roboglot.protocols.foxglove.context import Context
from roboglot.protocols.foxglove.errors import level_of, refusal
from roboglot.protocols.foxglove.table import TABLE
from roboglot.protocols.foxglove.vocabulary import DOOR
from roboglot.wire.contracts import contract
from roboglot.wire.foxglove.messages import Level, Malformed, Request, read_request

log = logging.getLogger(__name__)


async def answer(context: Context, message: str | bytes) -> None:
    """Execute one message."""
    tap, began = context.robot.tap, None
    try:
        request = read_request(message)
    except Malformed as malformed:
        if tap.watched:
            tap.reply(DOOR, "", b"", "error", str(malformed), tap.request(DOOR, "", message))
        context.status(Level.ERROR, str(malformed))
        return
    key = request.key if any(row.key == request.key for row in contract(DOOR)) else ""
    if tap.watched:
        began = tap.request(DOOR, key, message)
    level, why = await _do(context, request)
    reply = refusal(request, why, level) if why else ""
    if why:
        context.send(reply)
    if tap.watched:
        tap.reply(DOOR, key, reply, level.name.lower() if why else "ok", why, began)


async def _do(context: Context, request: Request) -> tuple[Level, str]:
    """Execute a request; return the reason of a refusal, empty on success."""
    operation = TABLE.get(request.key)
    if operation is None:
        return Level.ERROR, "this robot does not have that"
    try:
        context.robot.admission.check(DOOR, request.key, operation.right or Right.ADMIN)
        context.robot.starts.check(operation.right)
        await operation.call(context, request.values)
    except BadParameters as bad:
        return Level.ERROR, str(bad)
    except RobotError as error:
        return level_of(error), str(error)
    except Exception as error:  # one message must not end the connection
        log.exception("robot %s: %s crashed", context.robot.id, request.key)
        return Level.ERROR, f"the robot could not do it: {error}"
    return Level.INFO, ""
