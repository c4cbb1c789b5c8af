"""The parts of ASGI that the console needs: a request's body, an answer, a problem, and the end of its session."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable, Mapping, MutableMapping
from contextvars import ContextVar
from typing import Any, TypeVar

import msgspec

from roboglot.console.settings import BODY_MAX, BODY_SECONDS_MAX
from roboglot.validation import why_invalid

T = TypeVar("T")
Scope = MutableMapping[str, Any]
Message = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[Message]]
Send = Callable[[MutableMapping[str, object]], Awaitable[None]]
Rows = list[tuple[bytes, bytes]]

session_lasts: ContextVar[Callable[[], bool]] = ContextVar("session_lasts", default=lambda: True)
"""Returns False once the current client has signed out."""
SAFETY: Rows = [
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"no-referrer"),
    (b"cross-origin-opener-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
]


class Problem(Exception):
    """A refused or failed request: the status, and the reason in plain words."""

    def __init__(self, status: int, why: str) -> None:
        super().__init__(why)
        self.status, self.why = status, why


async def read_json(receive: Receive) -> Mapping[str, object]:
    """Return the body as a JSON object; empty without a body. Raises Problem."""
    body = b""
    deadline = asyncio.get_running_loop().time() + BODY_SECONDS_MAX
    while True:
        try:
            async with asyncio.timeout_at(deadline):
                message = await receive()
        except TimeoutError:
            raise Problem(408, f"the body took longer than {BODY_SECONDS_MAX:g} s") from None
        if message["type"] != "http.request":
            raise Problem(400, "the client went away")
        body += message.get("body", b"")
        if len(body) > BODY_MAX:
            raise Problem(413, f"a body has at most {BODY_MAX} bytes")
        if not message.get("more_body"):
            break
    try:
        return msgspec.json.decode(body, type=dict) if body else {}
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise Problem(400, f"the body is not a JSON object: {why_invalid(error)}") from None


async def read_as(receive: Receive, kind: type[T]) -> T:
    """Return the body as a value of a type, or raise Problem."""
    try:
        return msgspec.convert(await read_json(receive), kind)
    except msgspec.ValidationError as error:
        raise Problem(400, why_invalid(error, "the body", wanted=kind)) from None


async def answer(send: Send, status: int, content_type: bytes, body: bytes, more: Rows | None = None) -> None:
    """Send a whole answer."""
    headers = [(b"content-type", content_type), (b"content-length", b"%d" % len(body)), *SAFETY, *(more or [])]
    await send({"type": "http.response.start", "status": status, "headers": headers})
    await send({"type": "http.response.body", "body": body})


async def answer_json(send: Send, value: object, status: int = 200, more: Rows | None = None) -> None:
    """Send ``value`` as JSON."""
    headers = [(b"cache-control", b"no-store"), *(more or [])]
    await answer(send, status, b"application/json", msgspec.json.encode(value), headers)
