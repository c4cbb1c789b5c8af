"""The encrypted connection between both ends of a tunnel, cut into frames."""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable
from typing import cast

from roboglot.access.tunnel.frames import HEAD, BadFrame, FrameKind, TunnelFrame

EARLY_MAX = 16  # frames kept until a reader is set

Take = Callable[[FrameKind, int, bytes], None]
_KINDS = {int(kind): kind for kind in FrameKind}


class TunnelLink(asyncio.Protocol):
    """``first`` waits for a frame; after ``follow``, frames go to its callback.

    ``made`` is called when connected, ``stir`` with the size of data sent and received by streams.
    """

    def __init__(
        self, made: Callable[[TunnelLink], None] = lambda _link: None, stir: Callable[[int], None] = lambda _size: None
    ) -> None:
        self._made, self._stir = made, stir
        self._take: Take | None = None
        self._crowded: Callable[[bool], None] = lambda _crowded: None
        self._buffer = bytearray()
        self._early: deque[TunnelFrame] = deque()
        self._news = asyncio.Event()
        self.transport: asyncio.Transport
        self.lost: asyncio.Future[str] = asyncio.get_running_loop().create_future()
        """Done when it has ended; why."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        """Take the transport of a new connection."""
        self.transport = cast(asyncio.Transport, transport)
        self._made(self)

    def data_received(self, data: bytes) -> None:
        """Cut data into frames; a bad frame ends the connection."""
        try:
            self._cut(data)
        except BadFrame as bad:
            self.end(str(bad))

    def connection_lost(self, exc: Exception | None) -> None:
        """End the link with its connection."""
        self.end(str(exc or "the other end hung up"))

    def pause_writing(self) -> None:
        """Report a full send buffer."""
        self._crowded(True)

    def resume_writing(self) -> None:
        """Report an emptied send buffer."""
        self._crowded(False)

    async def first(self) -> TunnelFrame:
        """Wait for a frame. Raises ConnectionError."""
        while not self._early:
            if self.lost.done():
                raise ConnectionError(self.lost.result())
            self._news.clear()
            await self._news.wait()
        return self._early.popleft()

    def follow(self, take: Take, crowded: Callable[[bool], None]) -> None:
        """Pass every frame to ``take`` from now on; ``crowded`` is called when the send buffer fills or empties."""
        self._take, self._crowded = take, crowded
        try:
            while self._early:
                take(*self._early.popleft())
        except BadFrame as bad:
            self.end(str(bad))

    def send(self, kind: FrameKind, number: int = 0, payload: bytes = b"") -> None:
        """Send a frame; it is lost if the connection is closing."""
        transport = self.transport
        if not transport.is_closing():
            transport.write(HEAD.pack(kind, number, len(payload)) + payload)
            if kind is FrameKind.DATA:
                self._stir(len(payload))

    def end(self, why: str) -> None:
        """Hang up."""
        if not self.lost.done():
            self.lost.set_result(why)
        self._news.set()
        self.transport.abort()

    def _cut(self, data: bytes) -> None:
        if self._take is not None and not self._buffer and len(data) >= HEAD.size:  # usually it is one whole frame
            number, stream, length = HEAD.unpack_from(data)
            if number == FrameKind.DATA and len(data) == HEAD.size + length:
                self._stir(length)
                self._take(FrameKind.DATA, stream, data[HEAD.size :])
                return
        buffer: bytes | bytearray = data
        if self._buffer:
            self._buffer += data
            buffer = self._buffer
        at, size = 0, len(buffer)
        while size - at >= HEAD.size:
            number, stream, length = HEAD.unpack_from(buffer, at)
            kind = _KINDS.get(number)
            if kind is None:
                raise BadFrame(f"there is no frame of kind {number}")
            end = at + HEAD.size + length
            if end > size:
                break
            self._hand_on(kind, stream, bytes(buffer[at + HEAD.size : end]))
            at = end
        self._buffer = bytearray(buffer[at:])

    def _hand_on(self, kind: FrameKind, stream: int, payload: bytes) -> None:
        if kind is FrameKind.DATA:
            self._stir(len(payload))
        if self._take is not None:
            self._take(kind, stream, payload)
        elif len(self._early) < EARLY_MAX:
            self._early.append(TunnelFrame(kind, stream, payload))
            self._news.set()
        else:
            raise BadFrame("too much before the greeting")
