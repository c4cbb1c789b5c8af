"""Before the ports whose clients can show nothing: lets in by address, and cuts off who may no more.

Where nobody is asked (``admission.asks``), nothing stands before the port.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from contextvars import copy_context
from typing import cast

from roboglot.model.admission import Forbidden, Right
from roboglot.model.client_context import ask_for
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)
OPEN_MAX = 1024  # connections of all clients to one robot's ports

Factory = Callable[[], asyncio.Protocol]


class Gate:
    """For the ports of one robot."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._open: dict[asyncio.Transport, tuple[str, str]] = {}  # who, and from which host
        self._leave: Callable[[], None] | None = None

    def before(self, factory: Factory, name: str, right: Right) -> Factory:
        """``factory``'s protocols for clients that have ``right``; the others are hung up on."""
        admission = self._robot.admission
        if not admission.asks:
            return factory
        if self._leave is None:
            self._leave = admission.on_lost(self._cut_off)
        return lambda: _Gatekeeper(self, factory, name, right)

    def close(self) -> None:
        """Cut off nobody any more."""
        if self._leave is not None:
            self._leave()
            self._leave = None

    def enter(self, transport: asyncio.Transport, name: str, right: Right) -> bool:
        """Whether the client at the other end may come in."""
        peer = transport.get_extra_info("peername") or ("", 0)
        address, admission = f"{peer[0]}:{peer[1]}", self._robot.admission
        who = admission.known(address)

        def check() -> None:
            ask_for(f"{name.partition(' ')[0]} {who or peer[0]}", address, who or "")
            admission.check(name.partition(" ")[0], f"connect to {name}", right)

        try:
            copy_context().run(check)  # the loop's own context stays nobody's
        except Forbidden:
            return False
        self._open = {known: owner for known, owner in self._open.items() if not known.is_closing()}
        count = sum(host == peer[0] for _, host in self._open.values())
        if count >= admission.connections_max or len(self._open) >= OPEN_MAX:
            log.warning("%s: %s turned away, it has %d connections", name, peer[0], count)
            return False
        self._open[transport] = who or "", peer[0]
        return True

    def _cut_off(self, who: str) -> None:
        for transport in [known for known, (owner, _) in self._open.items() if owner == who]:
            del self._open[transport]
            transport.abort()


class _Gatekeeper(asyncio.Protocol):
    """Until the client is known; then the port's own protocol takes over."""

    def __init__(self, gate: Gate, factory: Factory, name: str, right: Right) -> None:
        self._gate, self._factory, self._name, self._right = gate, factory, name, right

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        transport = cast(asyncio.Transport, transport)
        if not self._gate.enter(transport, self._name, self._right):
            transport.abort()
            return
        inner = self._factory()
        transport.set_protocol(inner)
        inner.connection_made(transport)
