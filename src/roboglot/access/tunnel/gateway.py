"""The robots' end: one TLS port that gives each client the doors of one robot, and nothing else.

Each tunnel calls the robot's ports from its own loopback address. So the robot's pushes and callbacks return to the
right tunnel, and the guard knows the client.
"""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import itertools
import logging
import secrets
import socket
import ssl
from collections.abc import AsyncIterator, Callable, Iterator, Mapping
from functools import partial
from ipaddress import IPv4Address
from pathlib import Path
from typing import cast
from weakref import WeakValueDictionary

import msgspec

from roboglot.access.guard import Guard, Tunnelled
from roboglot.access.tunnel.busy_poll import BusyPoll
from roboglot.access.tunnel.frames import BadFrame, FrameKind
from roboglot.access.tunnel.greeting import Hello, Welcome
from roboglot.access.tunnel.link import TunnelLink
from roboglot.access.tunnel.tunnel import Tunnel, TunnelLost
from roboglot.model.actions import Action
from roboglot.model.admission import Proof, ProofKind, Right, Unknown
from roboglot.model.robot import Robot
from roboglot.model.tap import Direction, Exchange
from roboglot.transport.connections import Connections
from roboglot.transport.listening import listen
from roboglot.transport.log_limiter import LogLimiter
from roboglot.transport.metered import Metered
from roboglot.transport.pipe import join
from roboglot.transport.tls import Tls, TlsPort, server_context
from roboglot.validation import decode_json
from roboglot.values import dataclass

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)

TUNNELS_MAX = 256
TUNNELS_OF_ONE_MAX = 64  # per identity
CONNECTIONS_MAX = 512  # tunnels, and connections that are not tunnels yet
HELLO_SECONDS_MAX = 5.0
FIRST_ADDRESS, ADDRESSES = IPv4Address("127.64.0.1"), 4 * TUNNELS_MAX  # of tunnels; other gateways may use some
PORTS_WITHIN = range(1, 1024)  # of connections within the process; the kernel assigns the ports of all others
EVERYWHERE = ("", "0.0.0.0", "::")
ELSEWHERE = {socket.AF_INET: "192.0.2.1", socket.AF_INET6: "2001:db8::1"}  # no machine's (RFC 5737, RFC 3849)
BROADCASTS = ("127.255.255.255", "255.255.255.255")


@dataclass(frozen=True, slots=True)
class Ports:
    """Ports of one robot: its address, TCP ports, destination ports of its datagrams, and ports of its callbacks."""

    address: str
    tcp: tuple[int, ...]
    pushes: tuple[int, ...]
    broadcasts: tuple[int, ...]
    callbacks: tuple[int, ...]


class Gateway:
    """Listens from ``start`` to ``close``. ``certificate`` and ``key`` are read at the start."""

    def __init__(
        self, guard: Guard, robots: Mapping[str, tuple[Robot, Ports]], host: str, port: int, tls: tuple[Path, Path]
    ) -> None:
        self._guard, self._robots, self._host, self.port, self._tls = guard, robots, host, port, tls
        self._server: asyncio.Server | None = None
        self._addresses: dict[str, str] = {}  # identity by the tunnel's address
        self._connections = Connections(CONNECTIONS_MAX)
        self._transports: set[asyncio.Transport] = set()  # also of those that still shake hands
        self._sessions: set[asyncio.Task[None]] = set()
        self._tunnels: dict[str, Tunnel] = {}  # by the key of their heartbeats

    async def start(self) -> None:
        """Listen. Raises OSError, ssl.SSLError."""
        tls = Tls(server_context(*self._tls, ssl.TLSVersion.TLSv1_3), plain=False)
        stir = BusyPoll().stir

        def encrypted() -> asyncio.Protocol:
            return TlsPort(lambda: TunnelLink(self._begin, stir), tls, self._guard.may_shake_hands)

        self._server = await listen(
            lambda: _Entry(self._guard, self._connections, self._transports, encrypted), self._host, self.port
        )
        self.port = self._server.sockets[0].getsockname()[1]

    def reached_at(self) -> str:
        """Return HOST:PORT for clients; for a gateway on all addresses, with the address of the default route."""
        host = self._host
        if host in EVERYWHERE:
            kind = socket.AF_INET6 if ":" in host else socket.AF_INET
            with socket.socket(kind, socket.SOCK_DGRAM) as probe:
                probe.connect((ELSEWHERE[kind], 9))  # a UDP connect sends nothing
                host = probe.getsockname()[0]
        return f"[{host}]:{self.port}" if ":" in host else f"{host}:{self.port}"

    def certificate(self) -> str:
        """Return the SHA-256 fingerprint of the gateway's certificate."""
        return hashlib.sha256(ssl.PEM_cert_to_DER_cert(_first(self._tls[0].read_text()))).hexdigest()

    async def close(self) -> None:
        """End all tunnels and connections."""
        if self._server is not None:
            self._server.close()
        for session in self._sessions:
            session.cancel()
        await asyncio.gather(*self._sessions, return_exceptions=True)
        for transport in tuple(self._transports):
            transport.abort()

    def _begin(self, link: TunnelLink) -> None:
        session = asyncio.get_running_loop().create_task(self._receive(link), name="tunnel")
        self._sessions.add(session)
        session.add_done_callback(self._sessions.discard)

    async def _receive(self, link: TunnelLink) -> None:
        host = (link.transport.get_extra_info("peername") or ("",))[0]
        try:
            await self._serve(link)
        except (TunnelLost, BadFrame, OSError, TimeoutError) as error:
            limited_log.info(host, "a tunnel of %s ended: %s", host, error or "no greeting came")
        except Unknown as unknown:
            link.send(FrameKind.REFUSED, 0, str(unknown).encode())
            link.transport.close()  # after the frames already queued
        except asyncio.CancelledError:
            log.info("the gateway closes")
        finally:
            if not link.transport.is_closing():
                link.end("it was closed here")

    async def _serve(self, link: TunnelLink) -> None:
        peer = link.transport.get_extra_info("peername") or ("", 0)
        async with asyncio.timeout(HELLO_SECONDS_MAX):
            frame = await link.first()
        request = _hello(frame.payload) if frame.kind is FrameKind.HELLO else Hello()
        if request.beats:
            await self._beat(request.beats, link)
            return
        name, token = request.robot, request.token
        who = await self._guard.admit(f"{peer[0]}:{peer[1]}", Proof(ProofKind.HTTP, f"Bearer {token}"))
        found = self._robots.get(name)
        if found is None or not self._guard.may(who, name, Right.SEE):
            raise Unknown(f"{who} has no right to see robot {name!r}")
        robot, ports = found
        with self._address(who, str(peer[0]), ports.callbacks) as own:
            log.info("%s drives robot %s through a tunnel from %s", who, name, peer[0])
            calls = _Calls(robot, ports, own, self._guard.tunnels[own].calls)
            tunnel = Tunnel(
                link,
                first=2,
                opened=calls.connect,
                datagram=lambda _port, _data: None,
                quiet=lambda: _stop(robot, own),
                drives=lambda: next(_driven(robot, own), None) is not None,
            )
            key = secrets.token_hex(16)
            self._tunnels[key] = tunnel
            leave = robot.admission.on_lost(lambda lost: link.end("rights were lost") if lost == who else None)
            try:
                async with _listening(tunnel, robot, ports, own):
                    words = Welcome(ports.tcp, ports.callbacks, ports.broadcasts, key)
                    link.send(FrameKind.WELCOME, 0, msgspec.json.encode(words))
                    await tunnel.run()
            finally:
                del self._tunnels[key]
                leave()

    async def _beat(self, key: str, link: TunnelLink) -> None:
        """Serve the second connection of a tunnel; its key came with the greeting of the first."""
        if (tunnel := self._tunnels.get(key)) is None:
            raise Unknown("there is no such tunnel")
        await tunnel.beat_over(link)

    @contextlib.contextmanager
    def _address(self, who: str, host: str, callbacks: tuple[int, ...]) -> Iterator[str]:
        """Yield a loopback address for one tunnel, at which the guard knows ``who``.

        No other gateway on this machine listens there at any of the ports ``callbacks``.
        """
        mine = sum(each == who for each in self._addresses.values())
        if len(self._addresses) >= TUNNELS_MAX or mine >= TUNNELS_OF_ONE_MAX:
            raise Unknown(f"{mine} tunnels of {who} are open, {len(self._addresses)} in all: no more are allowed")
        free = (a for n in range(ADDRESSES) if (a := str(FIRST_ADDRESS + n)) not in self._addresses)
        if (own := next((a for a in free if _is_free(a, callbacks)), None)) is None:
            raise Unknown(
                f"other programs listen on all addresses from {FIRST_ADDRESS} to {FIRST_ADDRESS + ADDRESSES - 1}"
            )
        self._addresses[own] = who
        self._guard.tunnels[own] = Tunnelled(who, host, WeakValueDictionary())
        try:
            yield own
        finally:
            del self._addresses[own], self._guard.tunnels[own]


class _Entry(asyncio.Protocol):
    """Meter before the gateway's TLS: counts connections and bytes by host. ``opened``: the transports of all."""

    def __init__(
        self,
        guard: Guard,
        connections: Connections,
        opened: set[asyncio.Transport],
        factory: Callable[[], asyncio.Protocol],
    ) -> None:
        self._guard, self._connections, self._opened, self._factory = guard, connections, opened, factory

    def connection_made(self, made: asyncio.BaseTransport) -> None:
        transport = cast(asyncio.Transport, made)
        host = (transport.get_extra_info("peername") or ("",))[0]
        if not self._connections.enter(host, self._guard.config.connections):
            limited_log.warning(
                host, "gateway: %s turned away, it has %d connections", host, self._connections.of(host)
            )
            transport.abort()
            return
        self._opened.add(transport)

        def left() -> None:
            self._connections.leave(host)
            self._opened.discard(transport)

        inner = Metered(self._factory(), partial(self._guard.bytes.spend, f"tunnel from {host}"), left)
        transport.set_protocol(inner)
        inner.connection_made(transport)


def _driven(robot: Robot, own: str) -> Iterator[Action]:
    """Yield the actions that a client of the tunnel drives by hand: losing its connection would stop them."""
    for action in robot.actions.running():
        if action.connection.rpartition(":")[0] == own and action.source.endswith(action.connection):
            yield action


def _stop(robot: Robot, own: str) -> None:
    for action in tuple(_driven(robot, own)):
        log.warning("a tunnel is silent: %s of %s stops", action.name, action.client)
        action.cancel("its client is out of reach", hard=True)


def _first(chain: str) -> str:
    """Return the first certificate of a file, which is the server's own."""
    end = "-----END CERTIFICATE-----"
    return f"{chain.partition(end)[0]}{end}"


def _hello(payload: bytes) -> Hello:
    """Read a greeting. Raises BadFrame."""
    try:
        return decode_json(payload, Hello)
    except msgspec.MsgspecError:
        raise BadFrame("this is not a client of roboglot") from None


class _Calls:
    """One tunnel's connections to the robot's ports."""

    def __init__(self, robot: Robot, ports: Ports, own: str, calls: WeakValueDictionary[int, asyncio.Protocol]) -> None:
        self._robot, self._ports, self._own, self._open = robot, ports, own, calls
        self._numbers = itertools.cycle(PORTS_WITHIN)

    async def connect(self, port: int, protocol: Callable[[], asyncio.Protocol]) -> object:
        """Connect within the process if the door offers that, else (gRPC) over loopback. Raises OSError."""
        if port not in self._ports.tcp:
            raise OSError(f"{port} is not a port of the robot")
        address = self._ports.address
        if (offered := self._robot.admission.offered(port)) is None:
            return await self._call(protocol(), address, port)
        server, door = offered
        if not server.is_serving():
            raise ConnectionRefusedError(f"nothing listens on port {port} now")
        tried = itertools.islice(self._numbers, len(PORTS_WITHIN))
        if (number := next((free for free in tried if free not in self._open), None)) is None:
            raise OSError(f"{len(PORTS_WITHIN)} connections of the tunnel are open")
        stream = self._open[number] = protocol()
        join(stream, door(), (self._own, number), (address, port))
        return None

    async def _call(self, stream: asyncio.Protocol, address: str, port: int) -> object:
        """Connect over loopback; the guard knows the local port before the door sees the connection."""
        caller = socket.socket(socket.AF_INET, socket.SOCK_STREAM)
        try:
            caller.setblocking(False)
            caller.bind((self._own, 0))
            self._open[caller.getsockname()[1]] = stream
            loop = asyncio.get_running_loop()
            await loop.sock_connect(caller, (address, port))
            return await loop.create_connection(lambda: stream, sock=caller)
        except BaseException:
            caller.close()
            raise


def _is_free(address: str, ports: tuple[int, ...]) -> bool:
    """Return whether nothing listens at these ports of a loopback address."""
    for port in ports:
        with socket.socket(socket.AF_INET, socket.SOCK_STREAM) as probe:
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                probe.bind((address, port))
            except OSError:
                return False
    return True


@contextlib.asynccontextmanager
async def _listening(tunnel: Tunnel, robot: Robot, ports: Ports, own: str) -> AsyncIterator[None]:
    """Send the robot's datagrams and calls to the tunnel's address through the tunnel.

    Datagrams are taken from the tap, as clients on this machine may hold the same ports on every address.
    """
    places = {f"{own}:{port}": port for port in ports.pushes}
    places |= {f"{host}:{port}": port for port in ports.broadcasts for host in BROADCASTS}

    def take(exchange: Exchange) -> None:
        if exchange.direction is Direction.PUSH and (port := places.get(exchange.connection)):
            tunnel.send_datagram(port, exchange.payload)

    async with contextlib.AsyncExitStack() as stack:
        for port in ports.callbacks:
            server = await listen(tunnel.accept(port), own, port)
            stack.callback(server.close)
        stack.callback(robot.tap.listen(take))  # last, so that nothing precedes the welcome
        yield
