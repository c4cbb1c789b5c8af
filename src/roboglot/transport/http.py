"""One HTTP connection of the console or the reference cloud: uvicorn's, with limits on a request's head.

Knows no path; the applications limit bodies. Times are the machine's.
"""

from __future__ import annotations

import asyncio
from typing import cast

from httptools import HttpParserError
from uvicorn.protocols.http.httptools_impl import HttpToolsProtocol

from roboglot.transport.outlet import Outlet

HEADER_BYTES = 4
"""Of each header, beside its name and value."""
REQUEST_SECONDS_MAX = 30.0
"""From the connection or the first byte of a request to the last of its head."""
HEAD_MAX = 32 * 1024
"""Bytes of a request's line and headers, with those after its body; the parser has no limit of its own."""


class BoundedConnection(HttpToolsProtocol):
    """Closes connections that send no complete head in time."""

    _timeout: asyncio.TimerHandle | None = None
    _head_bytes = 0
    _parsed_bytes = 0  # of the request's headers, also of those after a body in chunks

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(Outlet(cast(asyncio.Transport, transport)))
        self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        self._wait_no_more()
        super().connection_lost(exc)

    def data_received(self, data: bytes) -> None:
        if self._timeout is None and self.cycle is not None and self.cycle.response_complete:
            self._wait()  # also for bytes that do not start a request yet
        waiting = self._timeout
        super().data_received(data)
        if waiting is not None and self._timeout is waiting:
            self._head_bytes += len(data)
            if self._head_bytes > HEAD_MAX:
                self.transport.close()

    def on_message_begin(self) -> None:
        if self._timeout is None:  # immediately after the last request
            self._wait()
        self._parsed_bytes = 0
        super().on_message_begin()

    def on_url(self, url: bytes) -> None:
        self._measure(len(url))
        super().on_url(url)

    def on_header(self, name: bytes, value: bytes) -> None:
        self._measure(len(name) + len(value) + HEADER_BYTES)
        super().on_header(name, value)

    def on_headers_complete(self) -> None:
        self._wait_no_more()
        super().on_headers_complete()

    def _measure(self, size: int) -> None:
        self._parsed_bytes += size
        if self._parsed_bytes > HEAD_MAX:
            raise HttpParserError("the request's head is too large")  # answered with 400

    def _wait(self) -> None:
        self._head_bytes = 0
        self._timeout = self.loop.call_later(REQUEST_SECONDS_MAX, self.transport.close)

    def _wait_no_more(self) -> None:
        if self._timeout is not None:
            self._timeout.cancel()
            self._timeout = None
