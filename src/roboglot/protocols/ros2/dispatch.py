"""Dispatch of a message: reads CDR, finds the handler, reports errors. Never raises."""

from __future__ import annotations

import logging
from collections.abc import Callable

from roboglot.model.errors import RobotError
from roboglot.operations import Right
from roboglot.protocols.ros2.chapters import subscriptions  # noqa: F401 - fills the table
from roboglot.protocols.ros2.context import Context
from roboglot.protocols.ros2.errors import level_of
from roboglot.protocols.ros2.table import TABLE
from roboglot.protocols.ros2.vocabulary import DOOR, TYPES

log = logging.getLogger(__name__)
MESSAGE_MAX = 65536  # bytes
Read = Callable[[bytes, str], object]  # CDR and type; raises ValueError


async def answer(context: Context, key: str, data: bytes | None, read: Read) -> tuple[int, str]:
    """Execute one message; return level and text of the failure, empty on success.

    ``data`` is None for a message that was too long to be kept.
    """
    tap, began = context.robot.tap, None
    if tap.watched:
        began = tap.request(DOOR, key, data or b"")
    level, why = await _do(context, key, data, read)
    if tap.watched:
        tap.reply(DOOR, key, b"", "refused" if why else "ok", why, began)
    return level, f"{key}: {why}" if why else ""


async def _do(context: Context, key: str, data: bytes | None, read: Read) -> tuple[int, str]:
    operation = TABLE.get(key)
    assert operation is not None  # nothing else is subscribed to
    if data is None:
        return logging.ERROR, f"a message has at most {MESSAGE_MAX} bytes"
    try:
        context.robot.admission.check(DOOR, key, operation.right or Right.ADMIN)
        context.robot.starts.check(operation.right)
        try:
            message = read(data, TYPES[key])
        except ValueError as error:
            return logging.ERROR, f"the message cannot be read: {error}"
        await operation.run(context, {"message": message})
    except RobotError as error:
        return level_of(error), str(error)
    except Exception as error:  # one message must not end the listening
        log.exception("robot %s: %s crashed", context.robot.id, key)
        return logging.ERROR, f"the robot could not do it: {error}"
    return logging.INFO, ""
