"""One page's WebSocket: uvicorn's, with a limit on frames. Knows no message."""

from __future__ import annotations

import asyncio
from typing import cast

from uvicorn.protocols.websockets.wsproto_impl import WSProtocol
from wsproto.events import BytesMessage, Ping, Pong, TextMessage

from roboglot.transport.limiter import Limiter

FRAMES_MAX, FRAMES_BURST = 500.0, 2000.0  # a second, and at once: each costs as much as a message, even if it is empty
PORTION = 4096  # bytes that are read before the frames in them are counted


class PageSocket(WSProtocol):
    """Disconnects a client that sends more frames, pieces of messages or pings than any page."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(cast(asyncio.Transport, transport))
        self._frames = Limiter(FRAMES_MAX, FRAMES_BURST, self.loop.time)

    def data_received(self, data: bytes) -> None:
        for at in range(0, len(data), PORTION):
            if not self.transport.is_closing():
                super().data_received(data[at : at + PORTION])

    def handle_message(self, event: TextMessage | BytesMessage) -> None:
        if not event.frame_finished or self._counted():
            super().handle_message(event)

    def handle_ping(self, event: Ping) -> None:
        if self._counted():
            super().handle_ping(event)

    def handle_pong(self, event: Pong) -> None:
        if self._counted():
            super().handle_pong(event)

    def _counted(self) -> bool:
        """Count a frame; return False, and disconnect, if it is one too many."""
        if not (fine := self._frames.take("")):
            self.transport.abort()
        return fine
