"""One tunnel, at either end: streams with their own windows, datagrams, and heartbeats."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable
from typing import cast

from roboglot.access.tunnel.frames import CREDIT, PORT, BadFrame, FrameKind
from roboglot.access.tunnel.heartbeat import Heartbeat
from roboglot.access.tunnel.link import TunnelLink
from roboglot.access.tunnel.stream import RECEIVED_MAX, WINDOW, Stream

log = logging.getLogger(__name__)

STREAMS_MAX = 64
DEAF_MAX = 16 * 1024 * 1024  # bytes queued for an end that opens streams and does not read that they are closed
UNSENT_MAX = 1024 * 1024  # bytes queued for the tunnel; datagrams beyond this are dropped, as UDP may do
DATAGRAM_MAX = 32 * 1024  # bytes
QUICK = b"!"  # payload of a PING: answer in kind

Opened = Callable[[int, Callable[[], asyncio.Protocol]], Awaitable[object]]


class TunnelLost(ConnectionError):
    """The other end is gone or violates the protocol."""


class Tunnel:
    """One end of a tunnel; ``run`` it until it is lost.

    ``opened`` connects a port requested by the other end to a protocol of this end. ``first``: number of the first own
    stream; one end's are odd, the other's even. ``quiet`` is called after QUIET_AFTER s of silence of the other end;
    while ``drives``, both ends send quick heartbeats.
    """

    def __init__(
        self,
        link: TunnelLink,
        *,
        first: int,
        opened: Opened,
        datagram: Callable[[int, bytes], None],
        quiet: Callable[[], None] = lambda: None,
        drives: Callable[[], bool] = lambda: False,
    ) -> None:
        self._link = link
        self._beside: TunnelLink | None = None  # for heartbeats only: they arrive while the other link loses packets
        self._next = first
        self._opened, self._datagram, self._quiet, self._drives = opened, datagram, quiet, drives
        self._streams: dict[int, Stream] = {}
        self._opening: set[asyncio.Task[None]] = set()
        self._over = False
        self._loop = asyncio.get_running_loop()
        self._heart = Heartbeat(self._loop.time())

    async def run(self) -> None:
        """Carry data until the tunnel is lost, then end every stream. Raises TunnelLost."""
        self._heart.note_life(self._loop.time())
        beat = asyncio.ensure_future(self._beat())
        try:
            self._link.follow(self._take, self._crowd)
            raise TunnelLost(await asyncio.shield(self._link.lost))
        finally:
            self._over = True
            beat.cancel()
            for task in self._opening:
                task.cancel()
            for stream in tuple(self._streams.values()):
                stream.abort()
            self._link.end("it was closed here")
            if self._beside is not None:
                self._beside.end("its tunnel ended")
            await asyncio.gather(beat, *self._opening, return_exceptions=True)

    async def beat_over(self, link: TunnelLink) -> None:
        """Send heartbeats over a second connection, too, until it is lost or replaced."""
        if self._beside is not None:
            self._beside.end("another took its place")
        self._beside = link
        link.follow(self._take_beat, lambda _crowded: None)
        await asyncio.shield(link.lost)
        if self._beside is link:
            self._beside = None

    def accept(self, port: int) -> Callable[[], asyncio.Protocol]:
        """Return the protocol factory of a local server whose connections are carried to ``port`` at the other end."""

        def connected() -> asyncio.Protocol:
            if self._over or len(self._streams) >= STREAMS_MAX:
                return _Turned()
            number, self._next = self._next, self._next + 2
            self._link.send(FrameKind.OPEN, number, PORT.pack(port))
            return self._new(number)

        return connected

    def send_datagram(self, port: int, data: bytes) -> None:
        """Send to ``port`` at the other end; lost when the tunnel is full."""
        if self._link.transport.get_write_buffer_size() < UNSENT_MAX and len(data) <= DATAGRAM_MAX:
            self._link.send(FrameKind.DATAGRAM, 0, PORT.pack(port) + data)

    def _new(self, number: int) -> Stream:
        stream = self._streams[number] = Stream(number, self._link, self._forget)
        return stream

    def _forget(self, number: int) -> None:
        self._streams.pop(number, None)

    def _crowd(self, crowded: bool) -> None:
        for stream in tuple(self._streams.values()):
            stream.hold(crowded)

    async def _beat(self) -> None:
        while True:
            drives = self._drives()
            look = self._heart.look(self._loop.time(), drives)
            if look.beat:
                for link in (self._link, self._beside) if self._beside else (self._link,):
                    link.send(FrameKind.PING, 0, QUICK if drives else b"")
            if look.quiet:
                self._quiet()
            if look.lost:
                self._link.end("the other end is silent")
            await asyncio.sleep(look.pause)

    def _take_beat(self, kind: FrameKind, _number: int, _payload: bytes) -> None:
        if kind is not FrameKind.PING:
            raise BadFrame("this connection carries only heartbeats")
        self._heart.note_life_beside(self._loop.time())

    def _take(self, kind: FrameKind, number: int, payload: bytes) -> None:
        self._heart.heard = self._loop.time()
        stream = self._streams.get(number)
        if stream is not None and kind is FrameKind.DATA:
            stream.deliver(payload)
            if stream.undelivered > RECEIVED_MAX:
                raise BadFrame("more was sent than the window allows")
        elif stream is not None:
            self._feed(stream, kind, payload)
        elif kind is FrameKind.OPEN:
            if len(payload) != PORT.size or number % 2 == self._next % 2:
                raise BadFrame("this stream is not the other end's")
            if len(self._streams) >= STREAMS_MAX:
                raise BadFrame("too many streams")
            self._open(number, PORT.unpack(payload)[0])
        elif kind is FrameKind.PING and payload == QUICK:
            self._heart.note_life(self._heart.heard, quick=True)
        elif kind is FrameKind.DATAGRAM and len(payload) >= PORT.size:
            self._datagram(PORT.unpack_from(payload)[0], payload[PORT.size :])

    def _feed(self, stream: Stream, kind: FrameKind, payload: bytes) -> None:
        match kind:
            case FrameKind.CREDIT if len(payload) == CREDIT.size:
                stream.give(min(WINDOW, CREDIT.unpack(payload)[0]))
            case FrameKind.EOF:
                stream.deliver_end()
            case FrameKind.CLOSE:
                stream.close()
            case FrameKind.OPEN:
                raise BadFrame("this stream is open already")

    def _open(self, number: int, port: int) -> None:
        """Begin to connect a stream; close it at once while too many begin, which may have been closed meanwhile."""
        if len(self._opening) >= STREAMS_MAX:
            self._turn_away(number)
            return
        task = self._loop.create_task(self._answer(number, self._new(number), port))
        self._opening.add(task)
        task.add_done_callback(self._opening.discard)

    async def _answer(self, number: int, stream: Stream, port: int) -> None:
        try:
            await self._opened(port, lambda: stream)
        except OSError as error:
            log.info("cannot open port %d: %s", port, error)
            self._forget(number)
            self._turn_away(number)

    def _turn_away(self, number: int) -> None:
        """Tell the other end that its stream is closed; hang up if it does not read that."""
        if self._link.transport.get_write_buffer_size() > DEAF_MAX:
            self._link.end("the other end opens streams and does not read")
        self._link.send(FrameKind.CLOSE, number)


class _Turned(asyncio.Protocol):
    """A connection beyond the limit, closed at once."""

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        cast(asyncio.Transport, transport).abort()
