"""TLS before a port that also takes plain connections, with Python's own client at the other end."""

from __future__ import annotations

import asyncio
import contextlib
import shutil
import socket
import ssl
from collections.abc import AsyncIterator
from pathlib import Path
from typing import cast

import pytest

from roboglot.protocols.cyberdog.certificates import ensure_site
from roboglot.transport import tls as layer
from roboglot.transport.tls import Tls, TlsPort, server_context

BIG = 3_000_000  # bytes: far more than all buffers on the way


class Echo(asyncio.Protocol):
    """Sends back what comes, and counts who came."""

    opened = 0

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast("asyncio.Transport", transport)  # TLS has a class of its own
        Echo.opened += 1

    def data_received(self, data: bytes) -> None:
        self.transport.write(data)

    def pause_writing(self) -> None:
        self.transport.pause_reading()

    def resume_writing(self) -> None:
        self.transport.resume_reading()


class Late(Echo):
    """Answers when nothing more comes, and closes."""

    def data_received(self, data: bytes) -> None:
        self.heard = data

    def eof_received(self) -> bool:
        asyncio.get_running_loop().call_soon(self._answer)
        return True

    def _answer(self) -> None:
        self.transport.write(self.heard)
        self.transport.close()


@contextlib.asynccontextmanager
async def port(
    folder: Path, *, plain: bool = True, admit: bool = True, inner: type[Echo] = Echo
) -> AsyncIterator[tuple[int, ssl.SSLContext]]:
    """Yield a server's port, and the certificate that a client must trust."""
    Echo.opened = 0
    tls = Tls(server_context(*ensure_site(folder, {"127.0.0.1", "localhost"})), plain)
    loop = asyncio.get_running_loop()
    server = await loop.create_server(lambda: TlsPort(inner, tls, lambda _host: admit), "127.0.0.1", 0)
    trusting = ssl.create_default_context(cafile=str(folder / "apps" / "ca-cert.pem"))
    trusting.verify_flags |= ssl.VERIFY_X509_STRICT  # the default since Python 3.13
    yield server.sockets[0].getsockname()[1], trusting
    server.close()


async def echoed(number: int, data: bytes, context: ssl.SSLContext | None) -> bytes:
    """Return what comes back of ``data``; empty: it was hung up."""
    try:
        reader, writer = await asyncio.open_connection("127.0.0.1", number, ssl=context)
    except (ConnectionError, ssl.SSLError):
        return b""
    try:
        writer.write(data)
        async with asyncio.timeout(60.0):
            return await reader.readexactly(len(data))
    except (asyncio.IncompleteReadError, ConnectionError):
        return b""
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError, ssl.SSLError):
            await writer.wait_closed()


async def test_one_port_takes_both(tmp_path: Path) -> None:
    async with port(tmp_path) as (number, trusting):
        assert await echoed(number, b"plain", None) == b"plain"
        assert await echoed(number, b"secret", trusting) == b"secret"
        big = bytes(range(256)) * (BIG // 256)
        assert await echoed(number, big, trusting) == big


@pytest.mark.parametrize("half", ["TLS", "TCP"])
async def test_client_that_says_no_more_gets_its_answer(tmp_path: Path, half: str) -> None:
    async with port(tmp_path, inner=Late) as (number, trusting):
        reader, writer = await asyncio.open_connection("127.0.0.1", number)
        incoming, outgoing = ssl.MemoryBIO(), ssl.MemoryBIO()
        client = trusting.wrap_bio(incoming, outgoing, server_hostname="127.0.0.1")
        shaken = False
        while not shaken:
            try:
                client.do_handshake()
                shaken = True
            except ssl.SSLWantReadError:
                writer.write(outgoing.read())
                incoming.write(await reader.read(65536))
        client.write(b"ask")
        if half == "TLS":
            with contextlib.suppress(ssl.SSLWantReadError):
                client.unwrap()
        writer.write(outgoing.read() + b"what comes behind the end" * (half == "TLS"))
        if half == "TCP":
            writer.write_eof()
        async with asyncio.timeout(60.0):
            incoming.write(await reader.read())
        assert client.read() == b"ask"
        writer.close()


async def test_plain_connections_can_be_refused(tmp_path: Path) -> None:
    async with port(tmp_path, plain=False) as (number, trusting):
        assert await echoed(number, b"plain", None) == b""
        assert Echo.opened == 0
        assert await echoed(number, b"secret", trusting) == b"secret"


async def test_stagehakes_are_asked_for_first(tmp_path: Path) -> None:
    async with port(tmp_path, admit=False) as (number, trusting):
        assert await echoed(number, b"secret", trusting) == b""
        assert Echo.opened == 0


@pytest.mark.parametrize("data", [b"\x16", b"\x16\x03\x01\xff\xff" + bytes(100), b"\x16" * 100_000])
async def test_bytes_without_a_handshake_end_the_connection(
    tmp_path: Path, data: bytes, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(layer, "HANDSHAKE_SECONDS_MAX", 0.2)
    async with port(tmp_path) as (number, _):
        reader, writer = await asyncio.open_connection("127.0.0.1", number)
        writer.write(data)
        async with asyncio.timeout(60.0):
            with contextlib.suppress(ConnectionError):
                await reader.read()
        assert Echo.opened == 0
        writer.close()


async def test_a_silent_connection_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(layer, "HANDSHAKE_SECONDS_MAX", 0.1)
    async with port(tmp_path) as (number, _):
        reader, writer = await asyncio.open_connection("127.0.0.1", number)
        async with asyncio.timeout(60.0):
            with contextlib.suppress(ConnectionError):
                assert await reader.read() == b""
        writer.close()


def test_nothing_is_renegotiated(tmp_path: Path) -> None:
    context = server_context(*ensure_site(tmp_path, {"127.0.0.1"}))
    assert context.options & ssl.OP_NO_RENEGOTIATION
    assert context.minimum_version >= ssl.TLSVersion.TLSv1_2


@pytest.mark.skipif(not shutil.which("openssl"), reason="OpenSSL's own client is not installed")
async def test_client_that_keeps_renewing_keys_is_cut_off(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Python's client cannot ask. Each answer would wait for a client that reads nothing."""
    monkeypatch.setattr(layer, "REPLIES_MAX", 200)
    async with port(tmp_path) as (number, _):
        client = await asyncio.create_subprocess_exec(
            "openssl", "s_client", "-tls1_3", "-connect", f"127.0.0.1:{number}", stdin=-1, stdout=-3, stderr=-3
        )
        assert client.stdin is not None
        try:
            async with asyncio.timeout(60.0):
                with contextlib.suppress(ConnectionError):
                    while client.returncode is None:
                        client.stdin.write(b"K\n")
                        await client.stdin.drain()
                        await asyncio.sleep(0.002)
                await client.wait()
        finally:
            if client.returncode is None:
                client.kill()
                await client.wait()
        assert Echo.opened == 1


def test_a_certificate_lasts_until_a_name_is_added(tmp_path: Path) -> None:
    first = ensure_site(tmp_path, {"127.0.0.1"})[0].read_bytes()
    assert ensure_site(tmp_path, {"127.0.0.1"})[0].read_bytes() == first
    assert ensure_site(tmp_path, {"127.0.0.1", socket.gethostname()})[0].read_bytes() != first
