"""Bounded reading of request bodies from the socket."""

from __future__ import annotations

from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

from roboglot.protocols.slamware.errors import HttpError

Scope = dict[str, Any]
Receive = Callable[[], Awaitable[dict[str, Any]]]


class ClientGone(Exception):
    """The client left before its request was complete."""


async def read_body(scope: Scope, receive: Receive, most: int) -> bytes:
    """Read and return the whole body."""
    body = bytearray()
    async for chunk in chunks(scope, receive, most):
        body += chunk
    return bytes(body)


async def chunks(scope: Scope, receive: Receive, most: int) -> AsyncIterator[bytes]:
    """Yield the body in chunks. Raises HttpError 413 beyond the limit, announced or not."""
    too_long = HttpError(413, "Content Too Large", f"at most {most} bytes")
    for name, value in scope["headers"]:
        if name == b"content-length" and int(value) > most:
            raise too_long
    size = 0
    while True:
        message = await receive()
        if message["type"] == "http.disconnect":
            raise ClientGone
        size += len(message["body"])
        if size > most:
            raise too_long
        yield message["body"]
        if not message["more_body"]:
            return
