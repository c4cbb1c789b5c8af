"""Passes bytes between clients and one robot, unchanged and at once, whatever becomes of their recording."""

from __future__ import annotations

import asyncio
import logging
import os
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import cast

from roboglot.model.clock import RealClock
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.entries import Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.lines import Target
from roboglot.recording.proxy.discovery import PORT as DISCOVERY
from roboglot.recording.proxy.discovery import Announcer
from roboglot.recording.proxy.sniffers import SNIFFERS, Sniffer
from roboglot.recording.redaction import FIELDS, Redaction, without_picture
from roboglot.recording.thread import WriterThread

log = logging.getLogger(__name__)
ROBOT = "a"  # its name in the recording
CONNECT_SECONDS = 10.0
CONNECTIONS_MAX = 256
BUFFER_MAX = 1 << 20  # bytes queued for the slower end before the faster one is paused
SIDE_PORTS = {"robomaster": (40921, 40922, 40925)}  # video, audio, events: forwarded; events are also recorded
EVENTS, PUSHES = 40925, 40924


class Book:
    """Book of exchanges, with the time of this machine."""

    def __init__(
        self, path: Path, target: Target, version: str, *, redact: Sequence[str] = (), photos: bool = False
    ) -> None:
        """``redact``: further fields to leave out; ``photos``: with photos and films.

        Raises OSError where the file cannot be written.
        """
        facts = {"version": version, "robot": f"{target.door}://{target.host}:{target.port}", "clock": "x1"}
        self.files = Files(path, Origin(facts), Redaction((*FIELDS, *redact)), Limits())
        self.clock = RealClock()
        self._door, self._photos = target.door, photos
        self.files.open(time.time_ns())
        self.thread = WriterThread(self.files)
        self._epoch = self.clock.epoch() - self.clock.time()

    def note(
        self,
        connection: str,
        direction: Direction,
        operation: str,
        payload: bytes,
        status: str,
        began: float | None,
        now: float | None = None,
    ) -> float:
        """Write one exchange soon; returns its time, which is ``now`` where that is given."""
        now = self.clock.time() if now is None else now
        seconds = 0.0 if began is None else now - began
        client = f"{self._door} {connection.rpartition(':')[0]}"
        found = Exchange(
            now,
            ROBOT,
            self._door,
            connection,
            client,
            direction,
            operation,
            payload,
            status,
            "",
            seconds,
        )
        if not self._photos:
            found = without_picture(found)
        at = round((self._epoch + now) * 1e6) * 1000
        self.thread.put(Entry(f"/{ROBOT}/{self._door}", "exchange", at, time.time_ns(), found))
        return now

    def close(self) -> None:
        """Write what waits."""
        self.thread.close()


class _End(asyncio.Protocol):
    """One end of a connection; ``other`` gets its bytes first, then the sniffer a copy."""

    transport: asyncio.Transport

    def __init__(self) -> None:
        self.other: _End | None = None
        self.look: Callable[[bytes], None] | None = None
        self.waiting = bytearray()
        self.gone: Callable[[_End], None] = lambda _: None
        self.lost: asyncio.Future[None] = asyncio.get_running_loop().create_future()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        self.transport.set_write_buffer_limits(high=BUFFER_MAX)

    def data_received(self, data: bytes) -> None:
        if self.other is None:
            self.waiting += data
            if len(self.waiting) > BUFFER_MAX:
                self.transport.pause_reading()
        else:
            self.other.transport.write(data)
        if self.look is not None:
            try:
                self.look(data)
            except Exception as error:  # noqa: BLE001 - what is not understood passes all the same
                log.warning("a connection is no longer understood, and still passed: %s", error)
                self.look = None

    def join(self, other: _End) -> None:
        """Pass everything to ``other`` from now on, what has come already first."""
        self.other = other
        if self.waiting:
            other.transport.write(bytes(self.waiting))
            self.waiting.clear()
            self.transport.resume_reading()

    def pause_writing(self) -> None:
        if self.other is not None:
            self.other.transport.pause_reading()

    def resume_writing(self) -> None:
        if self.other is not None:
            self.other.transport.resume_reading()

    def eof_received(self) -> bool:
        if self.other is not None and self.other.transport.can_write_eof():
            self.other.transport.write_eof()
        return True

    def connection_lost(self, _exc: Exception | None) -> None:
        self.gone(self)
        if not self.lost.done():
            self.lost.set_result(None)
        if self.other is not None:
            self.other.transport.close()


class Relay:
    """Listens at ``address`` on the ports of the robot's protocol."""

    def __init__(self, target: Target, address: str, book: Book) -> None:
        """Raises ValueError for a protocol that it cannot stand between."""
        if target.door not in SNIFFERS:
            raise ValueError(f"no recording between a client and a robot of {target.door} yet")
        self._target, self._address, self._book = target, address, book
        self._servers: list[asyncio.Server] = []
        self._ends: set[_End] = set()
        self._dialling: set[asyncio.Task[None]] = set()
        self._hosts: set[str] = set()
        self._datagrams: asyncio.DatagramTransport | None = None
        self._out: asyncio.DatagramTransport | None = None
        self._announcer: Announcer | None = None

    async def open(self) -> None:
        """Listen. Raises OSError."""
        main = self._target.port
        for port in (main, *(p for p in SIDE_PORTS.get(self._target.door, ()) if p != main)):
            loop = asyncio.get_running_loop()
            try:
                self._servers.append(await loop.create_server(partial(_Client, self, port), self._address, port))
            except OSError as error:
                why = os.strerror(error.errno) if error.errno else str(error)
                raise OSError(f"cannot listen at {self._address}:{port}: {why}") from error
        if self._target.door == "robomaster":
            self._announcer = Announcer(self._target.host, self._address, partial(self._pushed, DISCOVERY))
            await self._announcer.open()

    def accept(self, client: _Client, port: int) -> None:
        """Dial the robot for a client that came; what the client says already waits, and is understood."""
        peer = client.transport.get_extra_info("peername")
        name = f"{peer[0]}:{peer[1]}" if peer else ""
        robot, sniffer = _End(), self._sniffer(name, port)
        if sniffer is not None:
            client.look, robot.look = sniffer.from_client, sniffer.from_robot
        dialling = self._dial(client, robot, name, port)
        task = asyncio.get_running_loop().create_task(dialling, name=f"relay {port}")
        self._dialling.add(task)
        task.add_done_callback(self._dialling.discard)

    async def _dial(self, client: _Client, robot: _End, name: str, port: int) -> None:
        if len(self._ends) >= 2 * CONNECTIONS_MAX:
            client.transport.abort()
            return
        try:
            dialling = asyncio.get_running_loop().create_connection(lambda: robot, self._target.host, port)
            await self._book.clock.wait_for(dialling, CONNECT_SECONDS)
        except (OSError, TimeoutError) as error:
            log.warning("%s:%d cannot be reached for %s: %s", self._target.host, port, name, error)
            client.transport.abort()
            return
        if client.transport.is_closing():
            robot.transport.abort()
            return
        for end in (client, robot):
            self._ends.add(end)
            end.gone = self._ends.discard
        if self._target.door == "robomaster":
            await self._listen_for_pushes(robot.transport.get_extra_info("sockname")[0], name.rpartition(":")[0])
        client.join(robot)
        robot.join(client)

    def _sniffer(self, name: str, port: int) -> Sniffer | None:
        def note(direction: Direction, operation: str, payload: bytes, status: str, began: float | None) -> float:
            return self._book.note(name, direction, operation, payload, status, began)

        if port == self._target.port:
            return SNIFFERS[self._target.door](note)
        return _Events(note) if port == EVENTS else None

    async def _listen_for_pushes(self, own: str, host: str) -> None:
        """Take the robot's datagrams where it sends them, at our own address, and pass them to the clients' hosts."""
        self._hosts.add(host)
        if self._datagrams is not None or own == host:
            return
        loop = asyncio.get_running_loop()
        try:
            self._out, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, local_addr=(self._address, 0))
            self._datagrams, _ = await loop.create_datagram_endpoint(
                lambda: _Pushes(self.push), local_addr=(own, PUSHES)
            )
        except OSError as error:
            log.warning("pushes of the robot are not passed: UDP %s:%d: %s", own, PUSHES, error.strerror)

    def push(self, data: bytes) -> None:
        """Pass one datagram, and note it."""
        for host in self._hosts:
            if self._out is not None:
                self._out.sendto(data, (host, PUSHES))
        self._pushed(PUSHES, data)

    def _pushed(self, port: int, data: bytes) -> None:
        """Note a datagram of the robot."""
        words = data.decode("utf-8", "replace").split()[:2]
        self._book.note(f"*:{port}", Direction.PUSH, f"> {' '.join(words)}", data, "", None)

    async def close(self) -> None:
        """Stop listening and hang up; returns when every connection is gone."""
        if self._announcer is not None:
            self._announcer.close()
        for server in self._servers:
            server.close()
        dialling = tuple(self._dialling)
        for task in dialling:
            task.cancel()
        await asyncio.gather(*dialling, return_exceptions=True)
        ends = tuple(self._ends)
        for end in ends:
            end.transport.abort()
        await asyncio.gather(*(end.lost for end in ends))
        for transport in (self._datagrams, self._out):
            if transport is not None:
                transport.close()


class _Client(_End):
    """The end of the client."""

    def __init__(self, relay: Relay, port: int) -> None:
        super().__init__()
        self._relay, self._port = relay, port

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        super().connection_made(transport)
        self._relay.accept(self, self._port)


class _Pushes(asyncio.DatagramProtocol):
    """Datagrams of the robot."""

    def __init__(self, push: Callable[[bytes], None]) -> None:
        self._push = push

    def datagram_received(self, data: bytes, _addr: object) -> None:
        self._push(data)


class _Events(Sniffer):
    """The EP's event port: the robot speaks, and no one asks."""

    _rest = b""

    def from_client(self, data: bytes) -> None:
        """Do nothing: nothing is asked here."""

    def from_robot(self, data: bytes) -> None:
        *whole, self._rest = (self._rest + data).split(b";")
        for part in whole:
            words = part.decode("utf-8", "replace").split()[:2]
            self._note(Direction.PUSH, f"> {' '.join(words)}", part + b";", "", None)
