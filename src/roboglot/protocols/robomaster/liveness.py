"""Detection of a driving client that has vanished silently; its motions are stopped.

While a client's motion runs, its host is probed at least ten times a second: by ICMP echo requests where the kernel
lets ordinary programs send them, and always by the kernel's own probes of the control connection, which it sends only
after a second of silence. What the client was sent and did not acknowledge counts as well. Knows
hosts and connections, not programs: one that hangs on a living host is alive. A peer lives in real time, whatever
the robot's clock does.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
import struct
from collections.abc import Callable, Iterable
from ipaddress import IPv4Address

from roboglot.protocols.robomaster.keepalive import unanswered
from roboglot.protocols.robomaster.limits import WATCH_MISSES_MAX, WATCH_PERIOD

log = logging.getLogger(__name__)

_ECHO = struct.pack("!BBHHH", 8, 0, 0, 0, 0) + b"roboglot"  # the kernel fills in checksum and identifier
_REPLY_MAX = 64  # bytes
REPLIES_MAX = 64  # echoes read at a time
GREETINGS = 3  # requests sent to a host before its client drives


class Echoes:
    """Echo requests to hosts; ``answered`` lists those that answered since the last call."""

    def __init__(self) -> None:
        self._heard: set[str] = set()
        self._socket: socket.socket | None = None
        with contextlib.suppress(OSError):  # not permitted (net.ipv4.ping_group_range): the kernel's probes remain
            self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM | socket.SOCK_NONBLOCK, socket.IPPROTO_ICMP)

    def send(self, host: str) -> None:
        """Send one echo request."""
        if self._socket:
            with contextlib.suppress(OSError):
                self._socket.sendto(_ECHO, (host, 0))

    def answered(self) -> set[str]:
        """Return the hosts that answered since the last call."""
        if self._socket:
            with contextlib.suppress(OSError):
                for _ in range(REPLIES_MAX):
                    self._heard.add(self._socket.recvfrom(_REPLY_MAX)[1][0])
        heard, self._heard = self._heard, set()
        return heard

    def close(self) -> None:
        """Close the socket."""
        if self._socket:
            self._socket.close()


class DrivingClient:
    """Client behind ``connection`` (None: a line that cannot be probed), with its signs of life."""

    def __init__(self, name: str, host: str, connection: socket.socket | None) -> None:
        self.name, self.host = name, host
        self._connection = connection
        self._echoes = False  # True if its host has ever answered: many do not
        self._misses = 0
        self._greetings = GREETINGS

    @property
    def askable(self) -> bool:
        """True for remote peers; the kernel reports every loopback disconnect."""
        with contextlib.suppress(ValueError):
            return self._connection is not None and not IPv4Address(self.host).is_loopback
        return False

    def rest(self, echoed: bool) -> bool:
        """Record that the client drives nothing; return whether to probe it anyway, to learn if its host answers."""
        self._misses = 0
        self._echoes = self._echoes or echoed
        self._greetings -= self._greetings > 0
        return self._greetings > 0

    def missing(self, echoed: bool, elapsed: float) -> bool:
        """Count one check, ``elapsed`` s after the last; return True after WATCH_MISSES_MAX without a sign of life.

        A miss is an unanswered probe; silence alone does not count.
        """
        assert self._connection
        try:
            probes, unacknowledged, silent = unanswered(self._connection)
            if probes:  # let the kernel repeat it at once: a single one may get lost
                self._connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE, 1)
        except OSError:
            return False  # closed: noticed elsewhere
        asked = self._echoes or probes > 0 or unacknowledged > 0
        self._echoes = self._echoes or echoed
        alive = echoed or silent < elapsed * 1000
        self._misses = self._misses + 1 if asked and not alive else 0
        return self._misses == WATCH_MISSES_MAX


class ClientWatch:
    """Watches the clients of one robot; ``drives`` returns whether one drives, ``gone`` stops its motions."""

    def __init__(
        self,
        drivers: Callable[[], Iterable[DrivingClient]],
        drives: Callable[[str], bool],
        gone: Callable[[str], object],
    ) -> None:
        self._drivers, self._drives, self._gone = drivers, drives, gone
        self._echoes: Echoes | None = None
        self._timer: asyncio.TimerHandle | None = None
        self._looked = 0.0

    def begin(self) -> None:
        """Watch from now on, until no connection is left."""
        if self._timer is None:
            self._echoes = self._echoes or Echoes()
            self._plan()

    def close(self) -> None:
        """Stop watching."""
        if self._timer:
            self._timer.cancel()
            self._timer = None
        if self._echoes:
            self._echoes.close()
            self._echoes = None

    def _plan(self) -> None:
        loop = asyncio.get_running_loop()
        self._looked = loop.time()
        self._timer = loop.call_later(WATCH_PERIOD, self._look)

    def _look(self) -> None:
        elapsed = asyncio.get_running_loop().time() - self._looked
        self._timer = None
        drivers = [driver for driver in self._drivers() if driver.askable]
        heard = self._echoes.answered() if self._echoes else set()
        for driver in drivers:
            echoed, ask = driver.host in heard, True
            if not self._drives(driver.name):
                ask = driver.rest(echoed)
            elif driver.missing(echoed, elapsed):
                log.warning("robomaster: %s does not answer; its motions are stopped", driver.name)
                self._gone(driver.name)
            if ask and self._echoes:
                self._echoes.send(driver.host)
        if drivers:
            self._plan()
