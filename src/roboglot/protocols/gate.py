"""Gate in front of a robot's ports: counts and meters connections, admits by address, and disconnects on revocation.

With open access (``admission.enforced`` is false), only TLS, if configured, stands in front of a port.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextvars import copy_context
from functools import partial
from typing import NamedTuple, cast

from roboglot.model.admission import Admission, Forbidden, Right
from roboglot.model.client_context import set_client
from roboglot.transport.connections import Connections
from roboglot.transport.listening import listen
from roboglot.transport.log_limiter import LogLimiter
from roboglot.transport.metered import Metered
from roboglot.transport.tls import Tls, TlsPort

log = logging.getLogger(__name__)
BACKLOG = 2048  # connections waiting to be accepted
OPEN_MAX = 1024  # connections of all clients to one door's ports

Factory = Callable[[], asyncio.Protocol]


class Port(NamedTuple):
    """Listening port: its name in the log, the right that it needs, and its connections."""

    name: str
    right: Right | None
    connections: Connections


class Gate:
    """Gate of one door's ports."""

    def __init__(self, admission: Admission, tls: Tls | None = None) -> None:
        self._admission, self._tls = admission, tls
        self._open: dict[asyncio.Transport, str] = {}  # identity by connection
        self._log_limiter = LogLimiter(log)
        self._leave: Callable[[], None] | None = None

    def before(self, factory: Factory, name: str, right: Right | None = None, most: int = OPEN_MAX) -> Factory:
        """Wrap ``factory``: only clients with ``right`` get its protocols; others are disconnected.

        ``right`` None: the protocol identifies clients. At most ``most`` are open, half of them from one address.
        """
        if self._tls is not None:
            factory = partial(TlsPort, factory, self._tls, self._admission.may_shake_hands)
        if not self._admission.enforced:
            return factory
        if self._leave is None:
            self._leave = self._admission.on_lost(self._cut_off)
        port = Port(name, right, Connections(most))
        return lambda: _Gatekeeper(self, factory, port)

    async def listen(
        self,
        factory: Factory,
        name: str,
        address: str,
        port: int,
        right: Right | None = None,
        most: int = OPEN_MAX,
    ) -> asyncio.Server:
        """Listen at a port of the robot, with ``before`` in front; tunnels reach it within the process, too.

        Raises OSError naming an address that is taken.
        """
        gated = self.before(factory, name, right, most)
        server = await listen(gated, address, port, BACKLOG)
        self._admission.offer(server, gated)
        return server

    def close(self) -> None:
        """Stop cutting clients off."""
        if self._leave is not None:
            self._leave()
            self._leave = None

    def enter(self, transport: asyncio.Transport, port: Port) -> str | None:
        """Return the client's identity, or its host if unknown; None if it is not admitted."""
        peer = transport.get_extra_info("peername") or ("", 0)
        address, admission = f"{peer[0]}:{peer[1]}", self._admission
        who = admission.cached_identity(address)
        door = port.name.partition(" ")[0]

        def check(right: Right) -> None:
            set_client(f"{door} {who or peer[0]}", address, who or "")
            admission.check(door, f"connect to {port.name}", right)

        if port.right is not None:
            try:
                copy_context().run(check, port.right)  # the loop's own context stays free of clients
            except Forbidden:
                return None
        if not port.connections.enter(peer[0], admission.connections_max):
            count = port.connections.of(peer[0])
            self._log_limiter.warning(peer[0], "%s: %s turned away, it has %d connections", port.name, peer[0], count)
            return None
        self._open[transport] = who or ""
        return who or str(peer[0])

    def leave(self, transport: asyncio.Transport, port: Port, host: str) -> None:
        """Record the end of an admitted connection."""
        self._open.pop(transport, None)
        port.connections.leave(host)

    def spend(self, key: str, amount: int) -> float:
        """Count bytes; return the seconds to wait before the next."""
        return self._admission.spend(key, amount)

    def _cut_off(self, who: str) -> None:
        for transport in [known for known, owner in self._open.items() if owner == who]:
            transport.abort()


class _Gatekeeper(asyncio.Protocol):
    """Protocol until the client is identified; then the port's own takes over."""

    def __init__(self, gate: Gate, factory: Factory, port: Port) -> None:
        self._gate, self._factory, self._port = gate, factory, port

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport = cast(asyncio.Transport, transport)
        key = self._gate.enter(transport, self._port)
        if key is None:
            transport.abort()
            return
        host = (transport.get_extra_info("peername") or ("",))[0]
        ended = partial(self._gate.leave, transport, self._port, host)
        inner = Metered(self._factory(), partial(self._gate.spend, key), ended)
        transport.set_protocol(inner)
        inner.connection_made(transport)
