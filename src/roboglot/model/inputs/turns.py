"""Fair turns of the clients of a program that one thread serves. Knows no socket and no protocol.

In each WINDOW of the machine's time, the requests of all clients together may take PART of it before anyone waits. Then
those that had more than an equal part wait for the next window, and the others go on. So a client that asks as fast as
it can takes what is free, and slows neither the others nor the robots; one that is alone never waits. Parts are equal
between hosts, and between all connections: a host gains nothing by having many.
"""

from __future__ import annotations

import logging
from collections.abc import Callable

log = logging.getLogger(__name__)
WINDOW = 0.1  # s
PART = 0.5  # of a window, for the requests of all clients
LIMIT = PART * WINDOW  # s
ACTIVE_SECONDS = 1.0  # since its last request a client counts as one that wants its part
LOG_SECONDS = 10.0  # between two log lines on one client
HANDSHAKE_GAP = 0.02  # s between the beginnings of two handshakes with TLS, which hold the thread for a third of it
COST_MAX = 0.02  # s that one request counts: longer ones wait for something
CLIENTS_MAX = 4096  # connections counted at the same time; the oldest are dropped first


class Share:
    """Use that a connection, or all those of a host, made of a window."""

    __slots__ = ("host", "last", "name", "named", "used", "window")

    def __init__(self, name: str, host: Share | None = None) -> None:
        """``host``: the share of all connections of its host; None: this is one."""
        self.name = name
        self.host = host or self
        self.last = 0.0  # time of the last request
        self.named = -LOG_SECONDS  # time of the last log line
        self.used = 0.0  # s in the window of that number
        self.window = 0


class Turns:
    """Turns of all clients of a program. ``now``: the machine's time in s, as its one thread has it."""

    def __init__(self, now: Callable[[], float]) -> None:
        self.now = now
        self._shares: dict[str, Share] = {}  # by "host:port"
        self._hosts: dict[str, Share] = {}
        self._window, self._end, self._total = 0, 0.0, 0.0
        self._handshake = 0.0  # time at which the next one may begin
        self._connections = self._clients = 0  # active ones, counted in a window when someone has to wait

    def of(self, peer: str) -> Share:
        """Return the share of a connection from ``peer`` ("10.0.0.7:40312")."""
        share = self._shares.get(peer)
        if share is None:
            if len(self._shares) >= CLIENTS_MAX:
                self._forget()
            name = peer.rpartition(":")[0]
            host = self._hosts.setdefault(name, Share(name))
            share = self._shares[peer] = Share(peer, host)
        return share

    def wait(self, share: Share) -> float:
        """Return the seconds until a client may have its next answer; the log names one that waits."""
        now = self.now()
        share.last = share.host.last = now
        if now >= self._end:
            self._window += 1
            self._end, self._total, self._connections = now + WINDOW, 0.0, 0
        if self._total < LIMIT or not self._is_over(share, now):
            return 0.0
        if now - share.host.named >= LOG_SECONDS:
            share.host.named = now
            log.warning(
                "client %s waits for others: it asks for more than its share of %d connections",
                share.name,
                self._connections,
            )
        return self._end - now

    def took(self, share: Share, seconds: float) -> None:
        """Count a request that took ``seconds``."""
        window, host = self._window, share.host
        if seconds > COST_MAX:
            seconds = COST_MAX
        if share.window != window:
            share.window, share.used = window, 0.0
            if host.window != window:
                host.window, host.used = window, 0.0
        share.used += seconds
        host.used += seconds
        self._total += seconds

    def wait_to_dial(self) -> float:
        """Return the seconds until one more handshake may begin: those of many robots do not come at once."""
        now = self.now()
        begins = max(now, self._handshake)
        self._handshake = begins + HANDSHAKE_GAP
        return begins - now

    def _is_over(self, share: Share, now: float) -> bool:
        """Return whether a client, or its host, had more than an equal part of this window."""
        if not self._connections:
            recent = now - ACTIVE_SECONDS
            self._connections = sum(each.last >= recent for each in self._shares.values())
            self._clients = sum(each.last >= recent for each in self._hosts.values())
        return any(
            count > 1 and each.window == self._window and each.used > LIMIT / count
            for each, count in ((share, self._connections), (share.host, self._clients))
        )

    def _forget(self) -> None:
        """Drop the connections whose last request is oldest: a quarter."""
        oldest = sorted(self._shares.items(), key=lambda item: item[1].last)
        for peer, _ in oldest[: CLIENTS_MAX // 4]:
            del self._shares[peer]
        left = {share.host for share in self._shares.values()}
        self._hosts = {name: host for name, host in self._hosts.items() if host in left}
