"""Dispatch of a message of fleet control to the robot; a refusal becomes an error in the state."""

from __future__ import annotations

import logging

from roboglot.model.tap import SILENT
from roboglot.operations import Right
from roboglot.protocols.vda5050.chapters import actions, loads, maps, messages, power, sensing  # noqa: F401 - fill the table
from roboglot.protocols.vda5050.context import Context
from roboglot.protocols.vda5050.errors import Ignored, Rejected
from roboglot.protocols.vda5050.table import TABLE
from roboglot.protocols.vda5050.vocabulary import DOOR
from roboglot.wire.vda5050.orders import MESSAGE_MAX
from roboglot.wire.vda5050.versions import ErrorKind

log = logging.getLogger(__name__)


async def answer(context: Context, name: str, payload: object, *, retained: bool = False) -> None:
    """Process one message of the topic ``name``. ``retained``: the broker kept it, so it may be of any time."""
    data = bytes(payload) if isinstance(payload, bytes | bytearray) else str(payload or "").encode()
    tap, began = context.robot.tap, None
    if tap.watched:
        began = tap.request(DOOR, name, data[:MESSAGE_MAX])
    refusal = _retained(name) if retained else await _refusal(context, name, data)
    match refusal:
        case Rejected():
            context.errors.refuse(refusal)
            status = context.version.error(refusal.kind)
        case Ignored():
            log.info("robot %s ignored %s: %s", context.robot.id, name, refusal)
            status = SILENT
        case None:
            status = "accepted"
    if tap.watched:
        tap.reply(DOOR, name, b"", status, str(refusal or ""), began)


def _retained(name: str) -> Rejected:
    """Return the refusal of what the broker sends again at each connection: the robot would drive it each time."""
    return Rejected(ErrorKind.MALFORMED, f"{name} is refused, as the broker retained it: send it without `retain`")


async def _refusal(context: Context, name: str, data: bytes) -> Rejected | Ignored | None:
    """Run the handler of a message; return the reason of a refusal, if there is one."""
    operation = TABLE.get(name)
    try:
        if operation is None:
            raise Rejected(ErrorKind.UNSUPPORTED, f"this robot does not use zones: {name} is ignored")
        context.check(name, operation.right or Right.ADMIN)
        await operation.call(context, {"payload": data})
    except (Rejected, Ignored) as refusal:
        return refusal
    except Exception as error:  # one message must not end the connection to fleet control
        log.exception("robot %s: %s crashed", context.robot.id, name)
        return Rejected(ErrorKind.NOT_AVAILABLE, f"internal error in {name}: {error}")
    return None
