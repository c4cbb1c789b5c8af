"""Sends a recorded request to its door again, as a separate client over a real socket."""

from __future__ import annotations

import asyncio
from collections.abc import Sequence
from urllib.parse import quote

from roboglot.console.settings import EXCERPT_MAX, PAYLOAD_MAX, RESEND_HOLD, RESEND_SECONDS, RESENDS_MAX
from roboglot.console.wire_log import readable
from roboglot.model.clock import RealClock
from roboglot.model.errors import Busy, InvalidGoal, Unconnected
from roboglot.model.tap import Direction, Exchange
from roboglot.protocols.door import Endpoint
from roboglot.recording.lines import Answers, ClientError, Line, Target

SDK_MODE = b"command"  # must come first on the RoboMaster text door
_holding: set[asyncio.Task[None]] = set()


async def resend(exchange: Exchange, endpoint: Endpoint) -> Sequence[tuple[str, str]]:
    """Send ``exchange`` to ``endpoint`` again; return (status, answer) of each answer.

    The connection stays open for ``RESEND_HOLD`` s, as its actions end with it. Raises InvalidGoal for an exchange that
    cannot be sent, Busy for too many at a time, Unconnected without an answer.
    """
    if exchange.direction is not Direction.REQUEST:
        raise InvalidGoal("only a request can be sent again")
    if len(exchange.payload) >= PAYLOAD_MAX:
        raise InvalidGoal(f"a request of more than {PAYLOAD_MAX} bytes is not kept whole")
    if len(_holding) >= RESENDS_MAX:
        raise Busy(f"{RESENDS_MAX} requests were sent again a moment ago; wait {RESEND_HOLD:g} s")
    line = _target(exchange.door, endpoint).line(RealClock(), lambda _operation, _payload: None)
    opened = False
    try:
        async with asyncio.timeout(RESEND_SECONDS):
            await line.open()
            opened = True
            answers = await _ask(line, exchange)
    except BaseException as error:
        if opened:
            await line.close()
        if isinstance(error, (ClientError, TimeoutError)):
            why = str(error) or f"nothing came within {RESEND_SECONDS:g} s"
            raise Unconnected(f"the door did not answer: {why}") from None
        raise
    held = asyncio.get_running_loop().create_task(_hold(line), name="console resend")
    _holding.add(held)
    held.add_done_callback(_holding.discard)
    return [(status, readable(payload)[:EXCERPT_MAX]) for payload, status in answers]


async def _ask(line: Line, exchange: Exchange) -> Answers:
    if exchange.door == "robomaster" and not exchange.payload.startswith(SDK_MODE):
        await line.request("command", SDK_MODE, [b"ok;"])
    return await line.request(exchange.operation, exchange.payload, [b"{}"])


async def _hold(line: Line) -> None:
    try:
        await asyncio.sleep(RESEND_HOLD)
    finally:
        await line.close()


def _target(door: str, endpoint: Endpoint) -> Target:
    address = endpoint.address.removeprefix("tcp ").partition("://")
    where = (address[2] or address[0]).partition("/")[0]
    certificates = f"?certs={quote(str(endpoint.certificates))}" if endpoint.certificates else ""
    return Target(f"{door}://{where}{certificates}")
