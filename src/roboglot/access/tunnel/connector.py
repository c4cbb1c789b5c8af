"""The client's end: the vendors' ports of one robot on a loopback address of this machine."""

from __future__ import annotations

import asyncio
import contextlib
import hashlib
import json
import logging
import os
import socket
import ssl
from collections.abc import Callable, Collection
from functools import partial
from pathlib import Path
from typing import Protocol, cast

from msgspec import DecodeError
from msgspec.json import encode

from roboglot.access.tunnel.busy_poll import BusyPoll
from roboglot.access.tunnel.frames import FrameKind
from roboglot.access.tunnel.greeting import Hello, Welcome
from roboglot.access.tunnel.link import TunnelLink
from roboglot.access.tunnel.tunnel import Tunnel
from roboglot.transport.listening import listen
from roboglot.transport.log_limiter import LogLimiter
from roboglot.transport.tls import TlsCall
from roboglot.validation import decode_json, why_invalid

log = logging.getLogger(__name__)
limited_log = LogLimiter(log)

CALL_SECONDS_MAX = 5.0
GREETING_SECONDS_MAX = 10.0
BESIDE_AGAIN = 1.0  # s between attempts to open the second connection
BROADCAST = "127.255.255.255"
ROBOT_IP = b"robot ip "
# Ports of the vendors' clients, which robots call or send to: a CyberDog app's, RoboMaster's pushes and discovery.
APPS = frozenset({8981, 40924, 40926})


class NotTrusted(ConnectionError):
    """The gateway's certificate is not the known one."""


class Refused(ConnectionError):
    """The gateway refuses this client; the message has the reason."""


class Trust(Protocol):
    """Verifies the certificates of gateways."""

    def check(self, gateway: str, certificate: bytes) -> tuple[str, bool]:
        """Return the fingerprint, and whether it is new here. Raises NotTrusted."""


class KnownGateways:
    """Fingerprints of gateways' certificates, in a file: the first is trusted, later ones must equal it."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def check(self, gateway: str, certificate: bytes) -> tuple[str, bool]:
        """Return the fingerprint, and whether it is new here. Raises NotTrusted."""
        shown = hashlib.sha256(certificate).hexdigest()
        try:
            known = json.loads(self._path.read_text()) if self._path.exists() else {}
        except ValueError as error:
            raise NotTrusted(f"{self._path} cannot be read ({error}): remove it to start again") from None
        if (kept := known.get(gateway)) == shown:
            return shown, False
        if kept is not None:
            raise NotTrusted(
                f"{gateway} shows another certificate than before ({shown}, not {kept}): if that is intended,"
                f" remove its line from {self._path}"
            )
        self._path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        beside = self._path.with_name(f"{self._path.name}.{os.getpid()}")  # other processes may read it meanwhile
        beside.write_text(json.dumps({**known, gateway: shown}, indent=1))
        beside.replace(self._path)
        return shown, True


class AnnouncedGateway:
    """The fingerprint of a gateway from the registry of robots; no other is trusted."""

    def __init__(self, fingerprint: str) -> None:
        self._fingerprint = fingerprint

    def check(self, gateway: str, certificate: bytes) -> tuple[str, bool]:
        """Return the fingerprint, never as new. Raises NotTrusted."""
        shown = hashlib.sha256(certificate).hexdigest()
        if shown != self._fingerprint:
            raise NotTrusted(f"{gateway} shows another certificate ({shown}) than the registry has for it")
        return shown, False


class Connector:
    """Opens the robot's ports at ``address`` and carries them to the gateway; ``run`` ends when the tunnel is lost."""

    def __init__(
        self,
        gateway: str,
        port: int,
        robot: str,
        token: str,
        address: str,
        known: Trust,
        apps: Collection[int] = APPS,
    ) -> None:
        """``apps``: ports of this machine, TCP and UDP, that the gateway may reach."""
        self._gateway, self._port, self._robot, self._token = gateway, port, robot, token
        self._address, self._known, self._apps = address, known, apps

    async def run(self, ready: Callable[[list[int], str, bool], None]) -> None:
        """Carry the ports; call ``ready`` with the open ports, the fingerprint, and whether that is new.

        Raises NotTrusted, Refused, TunnelLost, OSError, TimeoutError.
        """
        link = await self._call(partial(TunnelLink, stir=BusyPoll().stir))
        try:
            fingerprint, new = self._check(link)
            words = await self._greet(link)
            await self._carry(link, words, lambda ports: ready(ports, fingerprint, new))
        finally:
            link.end("it was closed here")

    async def _call(self, made: Callable[[], TunnelLink]) -> TunnelLink:
        context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        context.minimum_version = ssl.TLSVersion.TLSv1_3
        context.check_hostname, context.verify_mode = False, ssl.CERT_NONE  # the fingerprint is checked instead
        loop = asyncio.get_running_loop()
        async with asyncio.timeout(CALL_SECONDS_MAX):
            transport, call = await loop.create_connection(lambda: TlsCall(made, context), self._gateway, self._port)
            try:
                return cast(TunnelLink, await call.over)
            except asyncio.CancelledError:
                transport.abort()
                raise

    def _check(self, link: TunnelLink) -> tuple[str, bool]:
        """Return the gateway's fingerprint, and whether it is new here. Raises NotTrusted."""
        certificate = link.transport.get_extra_info("ssl_object").getpeercert(binary_form=True)
        return self._known.check(f"{self._gateway}:{self._port}", certificate)

    async def _beat_beside(self, tunnel: Tunnel, key: str) -> None:
        """Keep a second connection for heartbeats; without it, the tunnel only tolerates lost packets less well."""
        while True:
            try:
                link = await self._call(TunnelLink)
                try:
                    self._check(link)
                    link.send(FrameKind.HELLO, 0, encode(Hello(beats=key)))
                    await tunnel.beat_over(link)
                finally:
                    link.end("it was closed here")
            except OSError as error:
                log.info("no second connection for heartbeats: %s", error)
            await asyncio.sleep(BESIDE_AGAIN)

    async def _greet(self, link: TunnelLink) -> Welcome:
        link.send(FrameKind.HELLO, 0, encode(Hello(self._robot, self._token)))
        async with asyncio.timeout(GREETING_SECONDS_MAX):
            frame = await link.first()
        if frame.kind is not FrameKind.WELCOME:
            raise Refused(frame.payload.decode("utf-8", "replace"))
        try:
            return decode_json(frame.payload, Welcome)
        except DecodeError as error:
            raise Refused(f"the gateway's greeting is not roboglot's: {why_invalid(error, wanted=Welcome)}") from None

    def _is_app(self, port: int) -> bool:
        """Return whether the gateway may reach this port of the machine; if not, log which option would allow it."""
        if port not in self._apps:
            words = "the gateway may not reach port %d here: --callback %d allows it"
            limited_log.warning(str(port), words, port, port)
        return port in self._apps

    async def _carry(self, link: TunnelLink, words: Welcome, ready: Callable[[list[int]], None]) -> None:
        loop = asyncio.get_running_loop()
        broadcasts = set(words.broadcasts)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            sender.setblocking(False)
            sender.setsockopt(socket.SOL_SOCKET, socket.SO_BROADCAST, 1)
            sender.bind((self._address, 0))  # clients check the source of a datagram

            def pass_on(port: int, data: bytes) -> None:
                if not self._is_app(port):
                    return
                if port in broadcasts and data.startswith(ROBOT_IP):  # on this machine, the robot is here
                    data = ROBOT_IP + self._address.encode()
                with contextlib.suppress(OSError):
                    sender.sendto(data, (BROADCAST if port in broadcasts else "127.0.0.1", port))

            async def call_back(port: int, protocol: Callable[[], asyncio.Protocol]) -> object:
                if not self._is_app(port):
                    raise OSError(f"{port} is not a port of an app")
                return await loop.create_connection(protocol, "127.0.0.1", port)

            def quiet() -> None:
                log.info("robot %s: the line is silent; what is driven by hand stops", self._robot)

            tunnel = Tunnel(link, first=1, opened=call_back, datagram=pass_on, quiet=quiet)
            async with contextlib.AsyncExitStack() as stack:
                for port in words.tcp:
                    server = await listen(tunnel.accept(port), self._address, port)
                    stack.callback(server.close)
                ready(list(words.tcp))
                beside = asyncio.ensure_future(self._beat_beside(tunnel, words.beats))
                stack.callback(beside.cancel)
                await tunnel.run()
