"""Limits of one client or address, and TLS on the doors that can: through real sockets."""

from __future__ import annotations

import asyncio
import contextlib
import ssl
from collections.abc import AsyncIterator
from dataclasses import replace
from pathlib import Path

import httpx
import pytest
from cryptography import x509
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidHandshake

from roboglot.access.store import Grant, open_store
from roboglot.config import AccessConfig, ConsoleConfig, RobotConfig, TlsConfig, load_config
from roboglot.operations import Right
from roboglot.runtime import Runtime
from tests.access.matrix import ADDRESS, CALLERS

POSE = "/api/core/slam/v1/localization/pose"
DRIVER = next(caller for caller in CALLERS if caller.name == "drive")
OTHER = next(caller for caller in CALLERS if caller.name == "edit")
CONNECTIONS = 4


@contextlib.asynccontextmanager
async def robots(data: Path, access: AccessConfig) -> AsyncIterator[Runtime]:
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    robots = (RobotConfig("a", "universal", ADDRESS),)
    console = ConsoleConfig(address=ADDRESS, port=0)
    runtime = Runtime(replace(base, robots=robots, access=access, console=console))
    await runtime.start()
    yield runtime
    await runtime.close()


@pytest.fixture
def token(data: Path) -> str:
    store = open_store(data)
    token = store.add_machine("cell", [Grant("a", frozenset({Right.DRIVE}))])
    for caller in (DRIVER, OTHER):
        store.allow(caller.address, [Grant("a", caller.rights)])
    store.close()
    return token


@pytest.mark.parametrize("port", [1448, 50053])
async def test_one_address_does_not_take_all_connections(data: Path, token: str, port: int) -> None:
    async with robots(data, AccessConfig(on=True, local=False, connections=CONNECTIONS)):
        held = [await asyncio.open_connection(ADDRESS, port, local_addr=(DRIVER.address, 0)) for _ in range(20)]
        async with asyncio.timeout(60.0):
            for reader, writer in held[CONNECTIONS:]:
                with contextlib.suppress(ConnectionError):
                    assert await reader.read() == b""
                writer.close()
        reader, writer = await asyncio.open_connection(ADDRESS, port, local_addr=(OTHER.address, 0))
        writer.write(b"GET /nothing HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        async with asyncio.timeout(60.0):
            assert b" 404 " in await reader.readuntil(b"\r\n")
        writer.close()
        for _, each in held[:CONNECTIONS]:
            each.close()
        async with asyncio.timeout(60.0):  # closed connections do not count
            while True:
                reader, writer = await asyncio.open_connection(ADDRESS, port, local_addr=(DRIVER.address, 0))
                writer.write(b"GET /nothing HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
                with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError):
                    assert b" 404 " in await reader.readuntil(b"\r\n")
                    break
                writer.close()
        writer.close()


async def test_bytes_are_limited_per_client(data: Path, token: str) -> None:
    access = AccessConfig(on=True, local=False, bytes=100_000)
    body = b" " * 900_000
    async with robots(data, access):
        transports = [
            httpx.AsyncHTTPTransport(local_address=caller.address, verify=False) for caller in (DRIVER, OTHER)
        ]
        greedy, modest = (httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", transport=each) for each in transports)
        async with greedy, modest:
            upload = asyncio.ensure_future(greedy.post("/api/core/motion/v1/actions", content=body, timeout=60.0))
            for _ in range(20):
                assert (await modest.get(POSE)).status_code == 200
            assert not upload.done()  # a burst of 200 kB, then 100 kB a second
            upload.cancel()
            with contextlib.suppress(asyncio.CancelledError):
                await upload


async def test_https_and_http_on_one_port(data: Path, token: str) -> None:
    bearer = {"authorization": f"Bearer {token}"}
    async with robots(data, AccessConfig(on=True, local=False, tls=TlsConfig(on=True))) as runtime:
        trusting = ssl.create_default_context(cafile=str(data / "cyberdog" / "apps" / "ca-cert.pem"))
        async with httpx.AsyncClient(verify=trusting, headers=bearer) as client:
            for scheme in ("https", "http"):
                assert (await client.get(f"{scheme}://{ADDRESS}:1448{POSE}")).status_code == 200
            assert runtime.console is not None
            assert runtime.console.address.startswith("https://")
            await runtime.console.ready()
            assert (await client.get(f"{runtime.console.address}/")).status_code == 200
            assert (await client.get(f"{runtime.console.address}/api/robots")).status_code == 200
            big = await client.get(f"https://{ADDRESS}:1448/openapi.json")
            assert len(big.content) > 100_000
        async with connect(f"wss://{ADDRESS}:50053/runs", ssl=trusting, additional_headers=bearer) as socket:
            await socket.send("")
            assert await socket.recv() == '{"runs": []}'


async def test_only_https_where_that_is_wanted(data: Path, token: str) -> None:
    access = AccessConfig(on=True, local=False, tls=TlsConfig(on=True, plain=False))
    bearer = {"authorization": f"Bearer {token}"}
    async with robots(data, access), httpx.AsyncClient(headers=bearer) as client:
        with pytest.raises(httpx.TransportError):
            await client.get(f"http://{ADDRESS}:1448{POSE}")
        with pytest.raises((InvalidHandshake, OSError, EOFError)):
            async with connect(f"ws://{ADDRESS}:50053/runs", additional_headers=bearer):
                pass


async def test_certificate_holds_for_each_way_in(data: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program at 0.0.0.0 had a certificate for 0.0.0.0, which no client on another machine could verify."""
    monkeypatch.setattr("roboglot.runtime.own_addresses", lambda: [ADDRESS, "10.88.0.1"])
    base = load_config(None, {"data": str(data), "world": "empty", "lockstep": True})
    console = ConsoleConfig(address="0.0.0.0", hosts=("robots.example",))
    config = replace(base, console=console, access=AccessConfig(on=True, tls=TlsConfig(on=True)))
    await Runtime(config).close()
    certificate = x509.load_pem_x509_certificate((data / "cyberdog/site/site-cert.pem").read_bytes())
    listed = certificate.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
    addresses = {str(address) for address in listed.get_values_for_type(x509.IPAddress)}
    assert {"127.0.0.1", "0.0.0.0", ADDRESS, "10.88.0.1"} <= addresses
    assert {"localhost", "robots.example"} <= set(listed.get_values_for_type(x509.DNSName))


def test_tls_is_configured_by_its_section(tmp_path: Path) -> None:
    file = tmp_path / "robots.toml"
    file.write_text("[access.tls]\nplain = false\n")
    access = load_config(file, {}).access
    assert access.on
    assert access.tls == TlsConfig(on=True, plain=False)
    file.write_text('[access.tls]\ncertificate = "a.pem"\n')
    with pytest.raises(ValueError, match="both certificate and key"):
        load_config(file, {})
