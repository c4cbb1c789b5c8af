"""Log lines for refused connections: gRPC itself does not report a failed TLS handshake.

At each handshake the kernel's table of connections shows the peers. A peer that is gone a moment later without any
request was refused, or gave up. On Linux only; elsewhere nothing is logged.
"""

from __future__ import annotations

import asyncio
import ipaddress
import logging
import sys
from collections.abc import Iterator
from pathlib import Path

from roboglot.protocols.cyberdog.app_link import host_of

log = logging.getLogger(__name__)
TABLES = (  # gRPC listens for both families at once where it can; each table takes the kernel 5 ms on a slow machine
    Path("/proc/self/net/tcp6"),
    Path("/proc/self/net/tcp"),
)
FIELDS = 12  # per line, at least
LISTENS, ESTABLISHED = "0A", "01"  # states of a connection
IPAddress = ipaddress.IPv4Address | ipaddress.IPv6Address
LATER = 1.0  # s (machine clock) after which a handshake should be complete
QUIET = 10.0  # s between two log lines about one host
LOOK_PERIOD = 0.1  # s between two reads of the table
TABLE_MAX = 128 * 1024  # bytes of it that are read
WATCHED_MAX = 256  # connections in the handshake, and hosts already logged
ASKED_MAX = 2048  # connections known to have made a request


class Handshakes:
    """Handshakes of one port. ``begun`` may be called from any thread, all else on the loop."""

    def __init__(self, address: str, port: int) -> None:
        self.port = port
        self._own = _own(address)
        self._loop = asyncio.get_running_loop()
        self._watched: set[str] = set()
        self._looked = -LOOK_PERIOD
        self._next: asyncio.TimerHandle | None = None  # at the end of LOOK_PERIOD, if there were more handshakes in it
        self._asked: dict[str, None] = {}  # oldest first
        self._logged_at: dict[str, float] = {}  # time by host
        self._looks: set[asyncio.TimerHandle] = set()

    def begun(self) -> None:
        """Record the start of a handshake; the table, which is long in a flood, is read once in LOOK_PERIOD."""
        now = self._loop.time()
        if self._loop.is_closed():
            return
        if (early := self._looked + LOOK_PERIOD - now) > 0.0:
            if self._next is None:
                self._loop.call_soon_threadsafe(self._look_later, early)
            return
        self._looked = now
        self._loop.call_soon_threadsafe(self._watch, _peers(self._own, self.port))

    def note_request(self, peer: str) -> None:
        """Record a request from ``peer`` (in gRPC's form): its handshake succeeded."""
        if peer not in self._asked:
            self._asked[peer] = None
            if len(self._asked) > ASKED_MAX:
                del self._asked[next(iter(self._asked))]

    def close(self) -> None:
        """Stop watching."""
        for look in self._looks:
            look.cancel()
        if self._next is not None:
            self._next.cancel()

    def _look_later(self, seconds: float) -> None:
        """Look for those whose handshakes began too soon after the last look."""
        if self._next is None:
            self._next = self._loop.call_later(seconds, self._look_now)

    def _look_now(self) -> None:
        self._next, self._looked = None, self._loop.time()
        self._watch(_peers(self._own, self.port))

    def _watch(self, peers: dict[str, str]) -> None:
        new = [peer for peer in peers if peer not in self._watched and peer not in self._asked]
        new = new[: WATCHED_MAX - len(self._watched)]
        self._watched.update(new)
        if new:
            look: asyncio.TimerHandle = self._loop.call_later(LATER, lambda: self._look(look, new))
            self._looks.add(look)

    def _look(self, look: asyncio.TimerHandle, peers: list[str]) -> None:
        self._looks.discard(look)
        self._watched.difference_update(peers)
        if silent := [peer for peer in peers if peer not in self._asked]:
            there = {peer for peer, state in _peers(self._own, self.port).items() if state == ESTABLISHED}
            for peer in silent:
                if peer not in there:
                    self._log_refusal(host_of(peer))

    def _log_refusal(self, host: str) -> None:
        now = self._loop.time()
        if now - self._logged_at.get(host, -QUIET) < QUIET:
            return
        if len(self._logged_at) >= WATCHED_MAX:
            self._logged_at.clear()
        self._logged_at[host] = now
        log.warning(
            "%s was refused on port %d before any request: it needs TLS and a certificate that this robot's CA signed"
            " (roboglot certs --export DIR)",
            host,
            self.port,
        )


def _own(address: str) -> IPAddress | None:
    """Return the ``address`` at which the port is open; None: any."""
    try:
        own = ipaddress.ip_address(address)
    except ValueError:
        return None
    return None if own.is_unspecified else own


def _peers(own: IPAddress | None, port: int) -> dict[str, str]:
    """Return the peers of open and recent connections, in gRPC's form, with their states."""
    peers: dict[str, str] = {}
    for table in TABLES:
        listens = False
        for local, remote, state in _connections(table, port):
            if own not in (None, _address(local)):
                continue
            if state == LISTENS:
                listens = True
                continue
            host, _, far = remote.partition(":")
            there = _address(host)
            written = f"ipv6:%5B{there}%5D" if there.version == 6 else f"ipv4:{there}"
            peers[f"{written}:{int(far, 16)}"] = state
        if listens:
            break
    return peers


def _connections(table: Path, port: int) -> Iterator[tuple[str, str, str]]:
    """Yield the local address, the remote address and port, and the state of a local port's connections."""
    try:
        with table.open() as file:
            lines = file.read(TABLE_MAX).splitlines()[1:]
    except OSError:
        return
    for line in lines:
        if len(fields := line.split()) < FIELDS:  # the last line may be cut off
            continue
        _, local, remote, state, *_ = fields
        here, _, at = local.partition(":")
        if int(at, 16) == port:
            yield here, remote, state


def _address(text: str) -> IPAddress:
    """Parse an address as the kernel writes it: 32-bit words in this machine's byte order."""
    words = [int(text[start : start + 8], 16).to_bytes(4, sys.byteorder) for start in range(0, len(text), 8)]
    address = ipaddress.ip_address(b"".join(words))
    return getattr(address, "ipv4_mapped", None) or address
