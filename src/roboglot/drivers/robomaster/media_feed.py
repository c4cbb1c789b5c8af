"""Video and audio packets of an EP, forwarded as they arrive and decoded on demand.

The robot streams only while a feed has viewers.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable, Iterable
from functools import partial
from typing import Generic, TypeVar

from roboglot.clients.errors import ClientError
from roboglot.drivers.supervisor import Supervisor
from roboglot.media.video import beside
from roboglot.model.clock import Clock
from roboglot.model.errors import RobotError
from roboglot.model.feed import Feed
from roboglot.values import dataclass

log = logging.getLogger(__name__)
RETRY = 1.0  # s between two attempts to open the port
P = TypeVar("P")
T = TypeVar("T")
D = TypeVar("D")


@dataclass(frozen=True, slots=True)
class Stream(Generic[P]):
    """A stream of the robot: ``on`` and ``off`` switch it; ``packets`` yields what arrives, until ClientError."""

    on: Callable[[], Awaitable[None]]
    off: Callable[[], Awaitable[None]]
    packets: Callable[[], AsyncIterator[P]]


class PacketFeed(Feed[P]):
    """Packets of one media port. Survives link losses."""

    def __init__(
        self,
        what: str,
        supervisor: Supervisor,
        clock: Clock,
        stream: Stream[P],
        *,
        queue_max: int,
        joinable: Callable[[P], bool] = lambda _: True,
    ) -> None:
        super().__init__(self._start, self._stop, queue_max=queue_max, joinable=joinable)
        self._what, self._supervisor, self._clock = what, supervisor, clock
        self._stream = stream
        self._carrying: asyncio.Task[None] | None = None

    def _start(self) -> None:
        self._carrying = asyncio.get_running_loop().create_task(self._run(), name=f"{self._what} of a RoboMaster")

    def _stop(self) -> None:
        if self._carrying is not None:
            self._carrying.cancel()
            self._carrying = None

        async def off() -> None:
            await self._stream.off()

        with contextlib.suppress(RobotError):  # without a link it has ended anyway
            self._supervisor.send_aside(f"stopping the {self._what}", off())

    async def _run(self) -> None:
        while True:
            try:
                await self._stream.on()
                async for packet in self._stream.packets():
                    self.push(packet)
            except ClientError as error:
                log.info("%s sends no %s: %s", self._supervisor.link.address, self._what, error)
            await self._clock.sleep(RETRY)


class DecodedFeed(Feed[T], Generic[P, D, T]):
    """A decoded ``packet_feed``: ``decoder`` makes a D, ``decode`` returns the items of a packet (none if corrupt)."""

    def __init__(
        self,
        packet_feed: PacketFeed[P],
        clock: Clock,
        decoder: Callable[[], D],
        decode: Callable[[D, P], Iterable[T]],
        *,
        queue_max: int,
    ) -> None:
        super().__init__(self._start, self._stop, queue_max=queue_max)
        self._packet_feed, self._clock, self._decoder, self._decode = packet_feed, clock, decoder, decode
        self._decoding: asyncio.Task[None] | None = None

    def _start(self) -> None:
        self._decoding = asyncio.get_running_loop().create_task(self._run(), name="decoding for a RoboMaster")

    def _stop(self) -> None:
        if self._decoding is not None:
            self._decoding.cancel()
            self._decoding = None

    async def _run(self) -> None:
        try:
            with self._packet_feed.subscribe() as packets:
                decoder = await beside(self._clock, self._decoder)
                async for packet in packets:
                    for item in await beside(self._clock, partial(self._decode, decoder, packet)):
                        self.push(item)
        except Exception:
            log.exception("decoding failed")
        self._decoding = None
        self.close()
