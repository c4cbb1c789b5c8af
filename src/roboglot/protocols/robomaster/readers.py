"""The event port: clients connect and only read. No event is sent yet; what they write is thrown away."""

from __future__ import annotations

import asyncio
from typing import cast

from roboglot.protocols.robomaster.connection import probe_for_life
from roboglot.protocols.robomaster.limits import EVENT_CONNECTIONS_MAX


class EventReader(asyncio.Protocol):
    """One reader; beyond EVENT_CONNECTIONS_MAX of them it is turned away."""

    transport: asyncio.Transport

    def __init__(self, readers: set[EventReader]) -> None:
        self._readers = readers

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport = cast(asyncio.Transport, transport)  # uvloop's is one without inheriting from it
        if len(self._readers) >= EVENT_CONNECTIONS_MAX:
            transport.abort()
            return
        self._readers.add(self)
        probe_for_life(transport.get_extra_info("socket"))

    def connection_lost(self, exc: Exception | None) -> None:
        self._readers.discard(self)
