"""One tunnel from either end: streams with their own windows, datagrams, and a beat that shows that both are there."""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable, Coroutine

from roboglot.access.tunnel.frames import CREDIT, PORT, BadFrame, Kind, encode, read_frame

log = logging.getLogger(__name__)

WINDOW = 256 * 1024  # bytes of a stream under way; what a slow reader leaves waits at the sender
PIECE = 32 * 1024  # bytes of one DATA frame
STREAMS_MAX = 64
UNSENT_MAX = 1024 * 1024  # bytes that wait for the tunnel; datagrams beyond are lost, as datagrams are
PING_PERIOD, LOOK_PERIOD = 0.1, 0.05  # s
QUIET_AFTER = 0.35  # s of silence after which the client is as good as gone: what it drives by hand stops
QUIET_LOOKS = 2  # in a row that see it
LOST_AFTER = 5.0  # s of silence that the tunnel and its connections bear: lines that lose packets come back

Ends = tuple[asyncio.StreamReader, asyncio.StreamWriter]


class TunnelLost(ConnectionError):
    """The other end is gone, or does not keep to the rules."""


class _Stream:
    """One TCP connection at this end."""

    def __init__(self) -> None:
        self.credit = WINDOW
        self.room = asyncio.Event()
        self.room.set()
        self.incoming: asyncio.Queue[bytes | None] = asyncio.Queue()
        self.waiting = 0  # bytes in the queue: never more than the window that the other end was given


class Tunnel:
    """``run`` until it is lost. ``opened`` connects what the other end asks for: a port to a connection of this end."""

    def __init__(
        self,
        reader: asyncio.StreamReader,
        writer: asyncio.StreamWriter,
        *,
        first: int,
        opened: Callable[[int], Awaitable[Ends]],
        datagram: Callable[[int, bytes], None],
        quiet: Callable[[], None] = lambda: None,
    ) -> None:
        """``quiet`` is called when the other end has said nothing for QUIET_AFTER."""
        self._reader, self._writer = reader, writer
        self._next = first  # streams of one end are odd, of the other even
        self._opened, self._datagram, self._quiet = opened, datagram, quiet
        self._streams: dict[int, _Stream] = {}
        self._tasks: set[asyncio.Task[None]] = set()
        self._over = self._silent = False
        self._heard = 0.0

    async def run(self) -> None:
        """Carry until the tunnel is lost; then every stream ends. Raises TunnelLost."""
        self._heard = asyncio.get_running_loop().time()
        beat = asyncio.ensure_future(self._beat())
        try:
            while True:
                kind, number, payload = await read_frame(self._reader)
                self._heard = asyncio.get_running_loop().time()
                self._take(kind, number, payload)
        except (BadFrame, asyncio.IncompleteReadError, OSError) as error:
            raise TunnelLost("the other end is silent" if self._silent else str(error)) from None
        finally:
            self._over = True
            beat.cancel()
            for task in self._tasks:
                task.cancel()
            self._writer.transport.abort()
            await asyncio.gather(beat, *self._tasks, return_exceptions=True)

    def carry(self, port: int, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """A connection of this end to ``port`` of the other, until either has ended."""
        if self._over or len(self._streams) >= STREAMS_MAX:
            writer.transport.abort()
            return
        number, self._next = self._next, self._next + 2
        self._send(Kind.OPEN, number, PORT.pack(port))
        task = self._begin(self._pump(number, self._new(number), (reader, writer)))
        task.add_done_callback(lambda _: writer.close())  # also when it was cancelled before it began

    def _begin(self, work: Coroutine[None, None, None]) -> asyncio.Task[None]:
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    def send_datagram(self, port: int, data: bytes) -> None:
        """To ``port`` at the other end; lost when the tunnel is full."""
        if self._writer.transport.get_write_buffer_size() < UNSENT_MAX and len(data) <= PIECE:
            self._send(Kind.DATAGRAM, 0, PORT.pack(port) + data)

    def _new(self, number: int) -> _Stream:
        self._streams[number] = stream = _Stream()
        return stream

    def _send(self, kind: Kind, number: int = 0, payload: bytes = b"") -> None:
        if not self._writer.transport.is_closing():
            self._writer.write(encode(kind, number, payload))

    async def _beat(self) -> None:
        loop, said, looks = asyncio.get_running_loop(), 0.0, 0
        while True:
            now = loop.time()
            if now - said >= PING_PERIOD:
                said = now
                self._send(Kind.PING)
            silent = now - self._heard
            looks = looks + 1 if silent >= QUIET_AFTER else 0
            if looks == QUIET_LOOKS:  # a single one may only mean that this end was held up
                self._quiet()
            if silent >= LOST_AFTER:
                self._silent = True
                self._writer.transport.abort()
            await asyncio.sleep(LOOK_PERIOD)

    def _take(self, kind: Kind, number: int, payload: bytes) -> None:
        if kind is Kind.OPEN:
            if len(payload) != PORT.size or number % 2 == self._next % 2:
                raise BadFrame("this is no stream of the other end's")
            if len(self._streams) >= STREAMS_MAX or number in self._streams:
                raise BadFrame("too many streams")
            self._begin(self._answer(number, self._new(number), PORT.unpack(payload)[0]))
        elif kind is Kind.DATAGRAM and len(payload) >= PORT.size:
            self._datagram(PORT.unpack(payload[: PORT.size])[0], payload[PORT.size :])
        elif (stream := self._streams.get(number)) is not None:
            self._feed(stream, kind, payload)

    def _feed(self, stream: _Stream, kind: Kind, payload: bytes) -> None:
        if kind is Kind.DATA:
            stream.waiting += len(payload)
            if stream.waiting > WINDOW:
                raise BadFrame("more was sent than the window allows")
            stream.incoming.put_nowait(payload)
        elif kind is Kind.CLOSE:
            stream.incoming.put_nowait(None)
        elif kind is Kind.CREDIT and len(payload) == CREDIT.size:
            stream.credit = min(WINDOW, stream.credit + CREDIT.unpack(payload)[0])
            stream.room.set()

    async def _answer(self, number: int, stream: _Stream, port: int) -> None:
        try:
            ends = await self._opened(port)
        except OSError as error:
            log.info("port %d: %s", port, error)
            self._streams.pop(number, None)
            self._send(Kind.CLOSE, number)
            return
        await self._pump(number, stream, ends)

    async def _pump(self, number: int, stream: _Stream, ends: Ends) -> None:
        """Both ways; the end of either is the end of both."""
        ways = [asyncio.ensure_future(self._out(number, stream, ends[0])), asyncio.ensure_future(
            self._in(number, stream, ends[1]))]  # fmt: skip
        try:
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
        finally:
            ends[1].close()  # before anything is waited for: this may be cancelled, too
            self._streams.pop(number, None)
            self._send(Kind.CLOSE, number)
            for way in ways:
                way.cancel()
            await asyncio.gather(*ways, return_exceptions=True)
            with contextlib.suppress(OSError):
                await ends[1].wait_closed()

    async def _out(self, number: int, stream: _Stream, reader: asyncio.StreamReader) -> None:
        with contextlib.suppress(OSError):
            while True:
                await stream.room.wait()
                if not (data := await reader.read(min(PIECE, stream.credit))):
                    return
                stream.credit -= len(data)
                if stream.credit == 0:
                    stream.room.clear()
                self._send(Kind.DATA, number, data)
                await self._writer.drain()

    async def _in(self, number: int, stream: _Stream, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while (data := await stream.incoming.get()) is not None:
                writer.write(data)
                await writer.drain()
                stream.waiting -= len(data)
                self._send(Kind.CREDIT, number, CREDIT.pack(len(data)))
