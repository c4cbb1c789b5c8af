"""Recorded pushes to the app: in order within a code, and kept for a while until the app is there.

Heartbeats are the recorded ones.

A live dog sends several at once; in a recording their order is known, so each waits for the delivery of the one before.
"""

from __future__ import annotations

import asyncio
from collections import deque
from dataclasses import field

from roboglot.model.clock import Clock
from roboglot.model.responder import Responder
from roboglot.protocols.cyberdog.app_link import AppLink
from roboglot.protocols.cyberdog.frame_queue import KEPT_SECONDS
from roboglot.values import dataclass
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT, ticks_of
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.text import code_of

WAITING_MAX = 4096  # per code; beyond this the oldest are dropped
CODES_MAX = 256


@dataclass(slots=True)
class _Line:
    waiting: deque[tuple[float, str]] = field(default_factory=lambda: deque(maxlen=WAITING_MAX))
    sending: asyncio.Task[None] | None = None


class PlayedPushes:
    """Recorded pushes for one app. ``door`` is the name under which they were recorded."""

    def __init__(self, responder: Responder, app: AppLink, clock: Clock, door: str) -> None:
        self._app, self._clock = app, clock
        self._beat = responder.first_push(door, HEARTBEAT)
        self._lines: dict[int, _Line] = {}
        app.on_found.append(self._go_on)

    def ticks(self, address: str) -> pb.Ticks | None:
        """Return the heartbeat recorded for this moment, or None."""
        return None if self._beat is None else ticks_of(self._beat.decode("utf-8", "replace"), address)

    def put(self, operation: str, message: bytes) -> None:
        """Queue a message; never waits."""
        if operation == HEARTBEAT:
            self._beat = message
            return
        if (code := code_of(operation)) is None:
            return
        text = message.decode("utf-8", "replace")
        if code not in self._lines and len(self._lines) >= CODES_MAX:
            return
        self._lines.setdefault(code, _Line()).waiting.append((self._clock.time(), text))
        self._go_on()

    def close(self) -> None:
        """Stop sending."""
        for line in self._lines.values():
            line.waiting.clear()
            if line.sending is not None:
                line.sending.cancel()

    def _go_on(self) -> None:
        if not self._app.connected:
            return
        for code, line in self._lines.items():
            if line.waiting and line.sending is None:
                line.sending = asyncio.get_running_loop().create_task(self._send(code, line), name=f"play {code}")

    async def _send(self, code: int, line: _Line) -> None:
        try:
            while line.waiting and self._app.connected:
                since, text = line.waiting.popleft()
                if self._clock.time() - since <= KEPT_SECONDS:
                    await self._app.send(code, text)
        finally:
            line.sending = None
