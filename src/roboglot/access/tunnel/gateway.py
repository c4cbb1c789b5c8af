"""The robots' end: one TLS port behind which each client gets the doors of one robot, and nothing else.

Each tunnel has a loopback address of its own, from which it calls the robot's ports. So the robot's pushes and
callbacks come back to the right tunnel, and the guard knows whose they are.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import socket
import ssl
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from ipaddress import IPv4Address
from pathlib import Path

from roboglot.access.guard import Guard
from roboglot.access.tunnel.frames import BadFrame, Kind, encode, read_frame
from roboglot.access.tunnel.tunnel import Ends, Tunnel, TunnelLost
from roboglot.model.admission import Proof, ProofKind, Right, Unknown
from roboglot.model.robot import Robot

log = logging.getLogger(__name__)

TUNNELS_MAX = 256
HELLO_SECONDS_MAX = 5.0
GOODBYE_SECONDS_MAX = 0.3
FIRST_ADDRESS = IPv4Address("127.64.0.1")
BROADCAST = "127.255.255.255"


@dataclass(frozen=True, slots=True)
class Ports:
    """Of one robot: its address, its TCP ports, where it sends datagrams, and where it calls its client back."""

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
        self._addresses: dict[str, str] = {}  # of tunnels, and whose they are
        self._sessions: set[asyncio.Task[None]] = set()

    async def start(self) -> None:
        """Listen. Raises OSError, ssl.SSLError."""
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.load_cert_chain(*self._tls)
        self._server = await asyncio.start_server(self._receive, self._host, self.port, ssl=context)
        self.port = self._server.sockets[0].getsockname()[1]

    async def close(self) -> None:
        """End all tunnels."""
        if self._server is not None:
            self._server.close()
        for session in self._sessions:
            session.cancel()
        await asyncio.gather(*self._sessions, return_exceptions=True)

    async def _receive(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        session = asyncio.current_task()
        assert session is not None
        self._sessions.add(session)
        try:
            await self._serve(reader, writer)
        except (TunnelLost, BadFrame, OSError, asyncio.IncompleteReadError, TimeoutError) as error:
            log.info("a tunnel ended: %s", error)
        except Unknown as unknown:
            writer.write(encode(Kind.REFUSED, 0, str(unknown).encode()))
            with contextlib.suppress(OSError):
                await writer.drain()
        except asyncio.CancelledError:
            log.info("the gateway closes")
        finally:
            writer.close()
            with contextlib.suppress(OSError, TimeoutError, asyncio.CancelledError):
                async with asyncio.timeout(GOODBYE_SECONDS_MAX):
                    await writer.wait_closed()
            self._sessions.discard(session)

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        peer = writer.get_extra_info("peername") or ("", 0)
        async with asyncio.timeout(HELLO_SECONDS_MAX):
            frame = await read_frame(reader)
        name, token = _hello(frame.payload) if frame.kind is Kind.HELLO else ("", "")
        who = await self._guard.admit(f"{peer[0]}:{peer[1]}", Proof(ProofKind.HTTP, f"Bearer {token}"))
        found = self._robots.get(name)
        if found is None or not self._guard.may(who, name, Right.SEE):
            raise Unknown(f"{who} has no right to see a robot {name!r}")
        robot, ports = found
        with self._address(who) as own:
            log.info("%s drives robot %s through a tunnel from %s", who, name, peer[0])
            tunnel = Tunnel(
                reader,
                writer,
                first=2,
                opened=lambda port: _connect(ports, port, own),
                datagram=lambda port, data: None,
            )
            leave = robot.admission.on_lost(lambda lost: writer.transport.abort() if lost == who else None)
            try:
                async with _listening(tunnel, ports, own):
                    words = {"tcp": ports.tcp, "callbacks": ports.callbacks, "broadcasts": ports.broadcasts}
                    writer.write(encode(Kind.WELCOME, 0, json.dumps(words).encode()))
                    await tunnel.run()
            finally:
                leave()

    @contextlib.contextmanager
    def _address(self, who: str) -> Iterator[str]:
        """A loopback address for one tunnel, at which the guard knows ``who``."""
        if len(self._addresses) >= TUNNELS_MAX:
            raise Unknown(f"{TUNNELS_MAX} tunnels are open")
        own = next(a for n in range(TUNNELS_MAX) if (a := str(FIRST_ADDRESS + n)) not in self._addresses)
        self._addresses[own] = who
        self._guard.tunnels[own] = who
        try:
            yield own
        finally:
            del self._addresses[own], self._guard.tunnels[own]


def _hello(payload: bytes) -> tuple[str, str]:
    """Robot and token. Raises BadFrame."""
    try:
        wish = json.loads(payload)
        return str(wish["robot"]), str(wish["token"])
    except (ValueError, KeyError, TypeError):
        raise BadFrame("this is no client of ours") from None


async def _connect(ports: Ports, port: int, own: str) -> Ends:
    if port not in ports.tcp:
        raise OSError(f"{port} is none of the robot's ports")
    return await asyncio.open_connection(ports.address, port, local_addr=(own, 0))


@contextlib.asynccontextmanager
async def _listening(tunnel: Tunnel, ports: Ports, own: str):  # type: ignore[no-untyped-def]
    """What the robot sends to the tunnel's address, and its calls there, go through the tunnel."""
    loop = asyncio.get_running_loop()
    async with contextlib.AsyncExitStack() as stack:
        for port in (*ports.pushes, *ports.broadcasts):
            host = BROADCAST if port in ports.broadcasts else own
            listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
            listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            try:
                listening.bind((host, port))
            except OSError as error:
                listening.close()
                log.warning("datagrams to port %d do not pass: %s", port, error)
                continue
            transport, _ = await loop.create_datagram_endpoint(
                lambda port=port: _Datagrams(tunnel, port, ports.address),  # type: ignore[misc]
                sock=listening,
            )
            stack.callback(transport.close)
        for port in ports.callbacks:
            server = await asyncio.start_server(partial(tunnel.carry, port), own, port)
            stack.callback(server.close)
        yield


class _Datagrams(asyncio.DatagramProtocol):
    def __init__(self, tunnel: Tunnel, port: int, robot: str) -> None:
        self._tunnel, self._port, self._robot = tunnel, port, robot

    def datagram_received(self, data: bytes, addr: tuple[str | int, ...]) -> None:
        if addr[0] == self._robot:
            self._tunnel.send_datagram(self._port, data)
