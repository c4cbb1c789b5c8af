"""The event port: clients connect and read the session's events; their input is discarded.

Explanations for teaching tools have a port of the same kind.
"""

from __future__ import annotations

import asyncio
import logging
from typing import cast

from roboglot.protocols.robomaster.foreign_protocols import Greeting, turn_away_strangers
from roboglot.protocols.robomaster.keepalive import probe_for_life
from roboglot.protocols.robomaster.limits import EVENT_BACKLOG_MAX, EVENT_CONNECTIONS_MAX

log = logging.getLogger(__name__)


class Readers:
    """Connected readers, at most EVENT_CONNECTIONS_MAX."""

    def __init__(self) -> None:
        self._transports: set[asyncio.Transport] = set()

    def __bool__(self) -> bool:
        """Return whether there is a reader."""
        return bool(self._transports)

    def connect(self) -> asyncio.Protocol:
        """Return the protocol of a new connection."""
        return _Reader(self._transports)

    def write(self, message: bytes) -> None:
        """Write once to each reader; one with EVENT_BACKLOG_MAX unread bytes is disconnected."""
        for transport in tuple(self._transports):
            if transport.get_write_buffer_size() > EVENT_BACKLOG_MAX:
                log.warning("robomaster: disconnected a client that does not read its events")
                transport.abort()
            else:
                transport.write(message)

    def close(self) -> None:
        """Disconnect all readers."""
        for transport in tuple(self._transports):
            transport.abort()


class _Reader(asyncio.Protocol):
    transport: asyncio.Transport

    def __init__(self, transports: set[asyncio.Transport]) -> None:
        self._transports = transports
        self._greeting = Greeting()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it
        if len(self._transports) >= EVENT_CONNECTIONS_MAX:
            transport.abort()
            return
        self._transports.add(transport)
        probe_for_life(transport)

    def data_received(self, data: bytes) -> None:
        turn_away_strangers(self._greeting, self.transport, data)

    def connection_lost(self, _exc: Exception | None) -> None:
        self._transports.discard(self.transport)
