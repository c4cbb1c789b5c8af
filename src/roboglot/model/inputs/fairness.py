"""Fairness to the clients of a program that one thread serves. Knows no socket and no protocol.

In each WINDOW of real time, the requests of all clients may together take PART of it before any client waits. Then
clients that used more than an equal share wait for the next window, and the others continue. So a client that sends as
fast as it can uses spare time only and slows neither other clients nor robots; a single client never waits. Shares are
equal between hosts and between connections: a host gains nothing by opening many. No client waits while other programs
hold the processor: the thread itself must have worked for that part of the window. Requests to stop a robot never
wait, nor do those queued before them.

Reading the clock would slow down requests that take little more than a plain call. A client may make LENT of these
before the next is timed; each is then charged at the cost of the last timed one. The first in a window is timed.
"""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")
log = logging.getLogger(__name__)
WINDOW = 0.1  # s
PART = 0.5  # of a window, for the requests of all clients
LIMIT = PART * WINDOW  # s
ACTIVE_SECONDS = 1.0  # since its last request, for which a client counts as active
LOG_SECONDS = 10.0  # between two log lines on one client
HANDSHAKE_GAP = 0.02  # s between the starts of two TLS handshakes, each of which holds the thread for a third of that
COST_MAX = 0.02  # s charged for one request at most: longer ones wait for something
HURRIED_MAX = 256  # requests of a connection that pass in a window because one of them stops a robot
LENT = 32  # requests before the next one that is timed
UNCOUNTED = 1 << 62
CLIENTS_MAX = 4096  # connections counted at the same time; the oldest are dropped first


class Use:
    """Time that a connection, or a host with all its connections, used in a window."""

    __slots__ = (
        "host",
        "hurried",
        "hurried_in",
        "last",
        "left",
        "lent",
        "name",
        "named",
        "owed",
        "typical",
        "used",
        "window",
    )

    def __init__(self, name: str, host: Use | None = None) -> None:
        """``host``: the use of all connections of its host; None: this is a host's own."""
        self.name = name
        self.host = host or self
        self.last = 0.0  # time of the last request
        self.named = -LOG_SECONDS  # time of the last log line
        self.used = 0.0  # s used in window number ``window``
        self.window = 0
        self.hurried = self.hurried_in = 0  # requests that passed out of turn, and in which window
        self.left = self.lent = UNCOUNTED  # untimed requests left, of those lent; unlimited without Fairness
        self.owed = 0  # untimed requests not yet charged
        self.typical = COST_MAX  # s: cost of the last timed request

    def settle(self) -> None:
        """Withdraw the rest of the lent requests."""
        self.owed += self.lent - self.left
        self.lent = self.left = 0


class Fairness:
    """Uses of all clients of a program; decides which have to wait.

    now: the machine's time, s. worked: processor time of the serving thread, s.
    """

    def __init__(self, now: Callable[[], float], worked: Callable[[], float]) -> None:
        self.now, self._worked = now, worked
        self._uses: dict[str, Use] = {}  # by "host:port"
        self._hosts: dict[str, Use] = {}
        self._lent: set[Use] = set()
        self._window, self._end, self._total = 0, 0.0, 0.0
        self._began = 0.0  # processor time at the beginning of the window
        self._handshake = 0.0  # time at which the next one may begin
        self._connections = self._clients = 0  # active ones, counted in a window when someone has to wait

    def of(self, peer: str) -> Use:
        """Return the share of a connection from ``peer`` ("10.0.0.7:40312")."""
        use = self._uses.get(peer)
        if use is None:
            if len(self._uses) >= CLIENTS_MAX:
                self._forget()
            name = peer.rpartition(":")[0]
            host = self._hosts.setdefault(name, Use(name))
            use = self._uses[peer] = Use(peer, host)
            use.settle()
        return use

    def wait(self, use: Use) -> float:
        """Return the seconds until a client may have its next answer; the log names one that waits."""
        now = self.now()
        use.last = use.host.last = now
        if now >= self._end:
            self._window += 1
            self._end, self._total, self._connections = now + WINDOW, 0.0, 0
            self._began = self._worked()
            if self._lent:
                self._take_back(now)
        if self._total < LIMIT or not self._is_over(use, now) or self._worked() - self._began < LIMIT:
            return 0.0
        if now - use.host.named >= LOG_SECONDS:
            use.host.named = now
            log.warning(
                "client %s waits for others: it asks for more than its share of %d connections",
                use.name,
                self._connections,
            )
        return self._end - now

    def hurries(self, use: Use, requests: int = 1) -> bool:
        """Return whether a waiting client's next ``requests`` may pass because one of them, or the next, is a stop.

        At most HURRIED_MAX per window: a client that adds stops to everything it sends has to wait, too.
        """
        if use.hurried_in != self._window:
            use.hurried_in, use.hurried = self._window, 0
        use.hurried += requests
        return use.hurried <= HURRIED_MAX

    def took(self, use: Use, seconds: float) -> None:
        """Count a request that took ``seconds``."""
        window, host = self._window, use.host
        if seconds > COST_MAX:
            seconds = COST_MAX
        if use.window != window:
            use.window, use.used = window, 0.0
            if host.window != window:
                host.window, host.used = window, 0.0
        use.used += seconds
        host.used += seconds
        self._total += seconds

    def lend(self, use: Use, seconds: float) -> None:
        """Charge a request that took ``seconds`` and the untimed ones before it; lend the next ones."""
        use.settle()
        owed, use.owed = use.owed, 0
        self.took(use, seconds + owed * min(seconds, use.typical))  # a request delayed by other programs is not typical
        use.typical = seconds
        use.left = use.lent = LENT
        self._lent.add(use)

    def timed(self, use: Use, answer: Callable[[], T | None]) -> T | None:
        """Return the timed result of ``answer`` and lend the next requests; None if the client has to wait."""
        if self.wait(use):
            return None
        begun = self.now()
        if (answered := answer()) is not None:
            self.lend(use, self.now() - begun)
        return answered

    def _take_back(self, now: float) -> None:
        """Have each client's next request timed, and update the time of its last request."""
        for use in self._lent:
            if use.left < use.lent:
                use.last = use.host.last = now
            use.settle()
        self._lent.clear()

    def wait_to_dial(self) -> float:
        """Return the seconds until the next TLS handshake may begin, to spread those of many robots."""
        now = self.now()
        begins = max(now, self._handshake)
        self._handshake = begins + HANDSHAKE_GAP
        return begins - now

    def _is_over(self, use: Use, now: float) -> bool:
        """Return whether a client, or its host, used more than an equal share of this window."""
        if not self._connections:
            recent = now - ACTIVE_SECONDS
            self._connections = sum(each.last >= recent for each in self._uses.values())
            self._clients = sum(each.last >= recent for each in self._hosts.values())
        return any(
            count > 1 and each.window == self._window and each.used > LIMIT / count
            for each, count in ((use, self._connections), (use.host, self._clients))
        )

    def _forget(self) -> None:
        """Drop the quarter of the connections whose last requests are oldest."""
        oldest = sorted(self._uses.items(), key=lambda item: item[1].last)
        for peer, _ in oldest[: CLIENTS_MAX // 4]:
            del self._uses[peer]
        left = {use.host for use in self._uses.values()}
        self._hosts = {name: host for name, host in self._hosts.items() if host in left}
