"""Output to one WebSocket client, with backpressure; a client that never reads is disconnected."""

from __future__ import annotations

import asyncio
import logging
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from websockets.server import ServerProtocol

log = logging.getLogger(__name__)

UNSENT_MAX = 16 * 1024 * 1024  # bytes queued for a slow reader, beyond which it is disconnected
ROOM = 256 * 1024  # bytes queued for a slow reader, beyond which programs wait for it
STALLED_SECONDS_MAX = 10.0  # for which such a reader may take nothing before it is disconnected


class Writer:
    """Writes from ``connect`` to ``lose``; before and after, it discards everything and nothing waits."""

    def __init__(self) -> None:
        self._transport: asyncio.Transport | None = None
        self._name = ""
        self._has_room = asyncio.Event()
        self._has_room.set()
        self._written = 0  # bytes
        self._stall_timer: asyncio.TimerHandle | None = None

    def connect(self, transport: asyncio.Transport, name: str) -> None:
        """Write to ``transport`` from now on; ``name`` identifies the client in the log."""
        self._transport, self._name = transport, name
        transport.set_write_buffer_limits(high=ROOM)

    def lose(self) -> None:
        """Stop writing: the client is gone."""
        self._transport = None
        self.resume()

    @property
    def lost(self) -> bool:
        """True if there is no client."""
        return self._transport is None

    @property
    def closing(self) -> bool:
        """True if the connection is closing or closed."""
        return self._transport is None or self._transport.is_closing()

    @property
    def unsent(self) -> int:
        """Number of bytes that the client has yet to read."""
        return 0 if self._transport is None else self._transport.get_write_buffer_size()

    @property
    def has_room(self) -> bool:
        """False while the client lags behind."""
        return self._has_room.is_set()

    async def drain(self) -> None:
        """Wait until the client has caught up."""
        await self._has_room.wait()

    def pause(self) -> None:
        """Make programs wait: the client lags behind."""
        self._has_room.clear()
        self._watch_reading()

    def resume(self) -> None:
        """Let programs continue: the client has caught up, or is gone."""
        self._has_room.set()
        if self._stall_timer is not None:
            self._stall_timer.cancel()
            self._stall_timer = None

    def may_write(self) -> bool:
        """Return True if another message can be written; disconnect a client with too many unread bytes."""
        if self.closing:
            return False
        if self.unsent > UNSENT_MAX:
            self._give_up()
            return False
        return True

    def flush(self, protocol: ServerProtocol) -> None:
        """Write the library's output; an empty chunk ends the connection."""
        for data in protocol.data_to_send():
            if self._transport is None:
                return
            if data:
                self._written += len(data)
                self._transport.write(data)
            else:
                self._transport.close()

    def close(self) -> None:
        """End the connection once everything is written."""
        if self._transport is not None:
            self._transport.close()

    def abort(self) -> None:
        """End the connection at once."""
        if self._transport is not None:
            self._transport.abort()

    def _watch_reading(self, taken_before: int = -1) -> None:
        """Disconnect a client that has read nothing since the last check; otherwise check again later."""
        if self._transport is None or self._has_room.is_set():
            return
        taken = self._written - self._transport.get_write_buffer_size()
        if taken == taken_before:
            self._give_up()
        else:
            loop = asyncio.get_running_loop()
            self._stall_timer = loop.call_later(STALLED_SECONDS_MAX, self._watch_reading, taken)

    def _give_up(self) -> None:
        log.warning("disconnected %s: it does not read its frames", self._name)
        self.abort()
