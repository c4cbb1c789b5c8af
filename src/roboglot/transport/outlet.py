"""A transport around another one, for HTTP servers: what is written to a client that is gone is dropped."""

from __future__ import annotations

import asyncio


class Outlet(asyncio.Transport):
    """Drops writes once the inner transport is closing.

    uvloop closes as soon as a write fails, and raises RuntimeError at the next one; the protocol hears of it only in
    the loop's next turn, when the rest of an answer may have been written.
    """

    def __init__(self, transport: asyncio.Transport) -> None:
        super().__init__()
        self._inner = transport

    def write(self, data: bytes | bytearray | memoryview[object]) -> None:
        """Send ``data`` unless the client is gone."""
        if not self._inner.is_closing():
            self._inner.write(data)

    def is_closing(self) -> bool:
        return self._inner.is_closing()

    def close(self) -> None:
        self._inner.close()

    def abort(self) -> None:
        self._inner.abort()

    def pause_reading(self) -> None:
        self._inner.pause_reading()

    def resume_reading(self) -> None:
        self._inner.resume_reading()

    def set_protocol(self, protocol: asyncio.BaseProtocol) -> None:
        self._inner.set_protocol(protocol)

    def get_extra_info(self, name: str, default: object = None) -> object:
        return self._inner.get_extra_info(name, default)
