"""The microphone as live Opus, encoded once for all listeners, and only while there is one."""

from __future__ import annotations

import asyncio
import logging

from roboglot.media.opus import AudioPacket, OpusEncoder
from roboglot.media.video import beside
from roboglot.model.clock import Clock
from roboglot.model.components.component import Component
from roboglot.model.components.sensing.microphone import Microphone
from roboglot.model.feed import Feed, Viewer

log = logging.getLogger(__name__)
QUEUE_MAX = 25  # packets: half a second


class AudioStream(Component):
    """Opus of the microphone, 50 packets of equal size per second: ``robot[AudioStream].subscribe()``."""

    def __init__(self, microphone: Microphone, clock: Clock) -> None:
        self._microphone, self._clock = microphone, clock
        self._feed: Feed[AudioPacket] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._encoding: asyncio.Task[None] | None = None

    def subscribe(self) -> Viewer[AudioPacket]:
        """Return a viewer of the packets from now on."""
        return self._feed.subscribe()

    def _begin(self) -> None:
        self._encoding = asyncio.get_running_loop().create_task(self._encode(), name="audio")

    def _end(self) -> None:
        if self._encoding is not None:
            self._encoding.cancel()
            self._encoding = None

    async def _encode(self) -> None:
        try:
            with self._microphone.subscribe() as blocks:
                encoder = await beside(self._clock, lambda: OpusEncoder(vbr=False))
                async for block in blocks:
                    self._feed.push(encoder.encode(block))  # a twentieth of a millisecond
        except Exception:
            log.exception("the audio crashed")
        self._encoding = None
        self._feed.close()
