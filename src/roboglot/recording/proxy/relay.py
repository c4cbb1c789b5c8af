"""Passes bytes between clients and one robot, unchanged and at once, even if their recording fails."""

from __future__ import annotations

import asyncio
import logging
import time
from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path

from roboglot.model.clock import RealClock
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.entries import Entry
from roboglot.recording.files import Files, Limits, Origin
from roboglot.recording.lines import Target
from roboglot.recording.proxy.discovery import PORT as DISCOVERY
from roboglot.recording.proxy.discovery import Announcer
from roboglot.recording.proxy.ends import End, Place, TcpProxy
from roboglot.recording.proxy.sniffers import SNIFFERS, Sniffer
from roboglot.recording.redaction import FIELDS, Redaction, without_picture
from roboglot.recording.thread import WriterThread

log = logging.getLogger(__name__)
ROBOT = "a"  # its name in the recording
SIDE_PORTS = {"robomaster": (40921, 40922, 40925)}  # video, audio, events: forwarded; events are also recorded
EVENTS, PUSHES = 40925, 40924


class ExchangeWriter:
    """Writes exchanges to a recording, with the time of this machine."""

    def __init__(
        self, path: Path, target: Target, version: str, *, redact: Sequence[str] = (), photos: bool = False
    ) -> None:
        """``redact``: further fields to leave out; ``photos``: record photos and films, too.

        Raises OSError if the file cannot be written.
        """
        facts = {"version": version, "robot": f"{target.door}://{target.host}:{target.port}", "clock": "x1"}
        if redact:
            facts["redact"] = ", ".join(redact)
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
        """Queue one exchange; return its time (s), which is ``now`` if given."""
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
        """Write the queue and close the file."""
        self.thread.close()


class Relay:
    """Listens at ``address`` on the ports of the robot's protocol."""

    def __init__(self, target: Target, address: str, writer: ExchangeWriter) -> None:
        """Raises ValueError for a protocol without a sniffer."""
        if target.door not in SNIFFERS:
            raise ValueError(f"no recording between a client and a robot of {target.door} yet")
        self._target, self._address, self._writer = target, address, writer
        self._crossing = TcpProxy(writer.clock)
        self.watch = self._crossing.watch
        self._hosts: set[str] = set()
        self._datagrams: asyncio.DatagramTransport | None = None
        self._out: asyncio.DatagramTransport | None = None
        self._announcer: Announcer | None = None

    async def open(self) -> None:
        """Listen. Raises OSError."""
        main = self._target.port
        for port in (main, *(p for p in SIDE_PORTS.get(self._target.door, ()) if p != main)):
            await self._crossing.listen(self._address, port, partial(self._accept, port), None)
        if self._target.door == "robomaster":
            self._announcer = Announcer(self._target.host, self._address, partial(self._pushed, DISCOVERY))
            await self._announcer.open()

    def _accept(self, port: int, client: End) -> None:
        """Dial the robot for a new client, whose first bytes wait meanwhile and are parsed."""
        robot, sniffer = End(self.watch), self._sniffer("{}:{}".format(*client.peer), port)
        if sniffer is not None:
            client.look, robot.look = sniffer.from_client, sniffer.from_robot
        joining = self._listen_for_pushes if self._target.door == "robomaster" else None
        # A robot on this machine is called from our own address: from the client's, it would push to the client.
        own = self._address if self._target.host.startswith("127.") and self._address.startswith("127.") else ""
        self._crossing.cross(client, Place(self._target.host, port, own=own), robot, joining)

    def _sniffer(self, name: str, port: int) -> Sniffer | None:
        def note(direction: Direction, operation: str, payload: bytes, status: str, began: float | None) -> float:
            return self._writer.note(name, direction, operation, payload, status, began)

        if port == self._target.port:
            return SNIFFERS[self._target.door](note)
        return _Events(note) if port == EVENTS else None

    async def _listen_for_pushes(self, client: End, robot: End) -> None:
        """Receive the robot's datagrams at our own address, and pass them to the clients' hosts."""
        own, host = robot.transport.get_extra_info("sockname")[0], client.peer[0]
        self._hosts.add(host)
        if own == host:
            log.warning(
                "the robot's pushes bypass the proxy and are not recorded: its client has this machine's address %s",
                own,
            )
            return
        if self._datagrams is not None:
            return
        loop = asyncio.get_running_loop()
        try:
            self._out, _ = await loop.create_datagram_endpoint(asyncio.DatagramProtocol, local_addr=(self._address, 0))
            self._datagrams, _ = await loop.create_datagram_endpoint(
                lambda: _Pushes(self.push), local_addr=(own, PUSHES)
            )
        except OSError as error:
            log.warning("cannot pass the robot's pushes: UDP %s:%d: %s", own, PUSHES, error.strerror)

    def push(self, data: bytes) -> None:
        """Pass one datagram on, and record it."""
        for host in self._hosts:
            if self._out is not None:
                self._out.sendto(data, (host, PUSHES))
        self._pushed(PUSHES, data)

    def _pushed(self, port: int, data: bytes) -> None:
        """Record a datagram of the robot."""
        words = data.decode("utf-8", "replace").split()[:2]
        self._writer.note(f"*:{port}", Direction.PUSH, f"> {' '.join(words)}", data, "", None)

    async def close(self) -> None:
        """Stop listening and hang up; returns when every connection is gone."""
        if self._announcer is not None:
            self._announcer.close()
        await self._crossing.close()
        for transport in (self._datagrams, self._out):
            if transport is not None:
                transport.close()


class _Pushes(asyncio.DatagramProtocol):
    """Datagrams of the robot."""

    def __init__(self, push: Callable[[bytes], None]) -> None:
        self._push = push

    def datagram_received(self, data: bytes, _addr: object) -> None:
        self._push(data)


class _Events(Sniffer):
    """The EP's event port, on which only the robot sends."""

    _rest = b""

    def from_client(self, data: bytes) -> None:
        """Do nothing: clients send no requests here."""

    def from_robot(self, data: bytes) -> None:
        *whole, self._rest = (self._rest + data).split(b";")
        for part in whole:
            words = part.decode("utf-8", "replace").split()[:2]
            self._note(Direction.PUSH, f"> {' '.join(words)}", part + b";", "", None)
