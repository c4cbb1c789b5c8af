"""The one translation of the model's errors to the protocol: a status, or the message's own reply."""

from __future__ import annotations

import logging

from roboglot.model.errors import RobotError
from roboglot.protocols import ros_commands
from roboglot.wire.foxglove.messages import Level, Request, asset_failure, message

LEVELS = {logging.WARNING: Level.WARNING, logging.ERROR: Level.ERROR}


def level_of(error: RobotError) -> Level:
    """Return the level of ``error`` in the protocol's numbers."""
    return LEVELS[ros_commands.level_of(error)]


def refusal(request: Request, why: str, level: Level = Level.ERROR) -> str | bytes:
    """Return the reply to a refused request."""
    values = request.values
    match request.key:
        case "serviceCallRequest" if _is_number(values.get("service")) and _is_number(values.get("call")):
            return message("serviceCallFailure", serviceId=values["service"], callId=values["call"], message=why)
        case "fetchAsset" if _is_number(values.get("requestId")):
            return asset_failure(values["requestId"], why)
        case _:
            return message("status", level=int(level), message=f"{request.key}: {why}")


def _is_number(value: object) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 32
