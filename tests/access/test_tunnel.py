"""A robot behind a gateway, as unmodified clients see it on their own machine."""

from __future__ import annotations

import asyncio
import contextlib
import json
import socket
from collections.abc import AsyncIterator, Callable, Collection
from ipaddress import ip_address
from pathlib import Path
from typing import Any, NoReturn

import httpx
import pytest

from roboglot.access.store import open_store
from roboglot.access.trail import open_trail
from roboglot.access.tunnel import connector, heartbeat
from roboglot.access.tunnel import tunnel as carrying
from roboglot.access.tunnel.connector import APPS, Connector, KnownGateways, NotTrusted, Refused
from roboglot.access.tunnel.frames import FrameKind, encode
from roboglot.access.tunnel.link import TunnelLink
from roboglot.model.clock import LockstepClock
from roboglot.runtime import Runtime
from roboglot.testing.addresses import free_addresses
from roboglot.transport import listening
from tests.access.conftest import dial, next_kind
from tests.access.matrix import ADDRESS

HERE = free_addresses(1)
POSE = "/api/core/slam/v1/localization/pose"


async def pushed_by(inbox: socket.socket, robot: str) -> bytes:
    """Return the first datagram from a robot's address, by which clients identify it.

    Robots of other programs on this machine may push to the same port.
    """
    async with asyncio.timeout(60):
        while True:
            data, (sender, _) = await asyncio.get_running_loop().sock_recvfrom(inbox, 1000)
            if sender == robot:
                return data


@contextlib.asynccontextmanager
async def connected(
    runtime: Runtime, token: str, folder: Path, robot: str = "a", apps: Collection[int] = APPS
) -> AsyncIterator[list[int]]:
    """Yield the robot's ports at HERE, while inside."""
    assert runtime._gateway is not None
    known = KnownGateways(folder / "gateways.json")
    link = Connector("127.0.0.1", runtime._gateway.port, robot, token, HERE, known, apps)
    opened: asyncio.Future[list[int]] = asyncio.get_running_loop().create_future()
    running = asyncio.ensure_future(link.run(lambda ports, _fingerprint, _new: opened.set_result(ports)))
    waited: tuple[asyncio.Future[Any], ...] = opened, running
    await asyncio.wait(waited, return_when=asyncio.FIRST_COMPLETED)
    if running.done():
        await running
    yield await opened
    running.cancel()
    with contextlib.suppress(asyncio.CancelledError, ConnectionError):
        await running


async def test_rest_passes_with_the_rights_of_the_token(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    async with connected(*gateway, tmp_path), httpx.AsyncClient(base_url=f"http://{HERE}:1448", verify=False) as client:
        assert (await client.get(POSE)).status_code == 200
        behind = {"x-forwarded-for": "203.0.113.7"}  # a proxy at the client's end of the tunnel
        assert (await client.get(POSE, headers=behind)).status_code == 200
        assert (await client.delete("/api/core/slam/v1/maps")).status_code == 403
        replies = await asyncio.gather(*(client.get("/openapi.json") for _ in range(10)))
        assert len({reply.content for reply in replies}) == 1
        assert len(replies[0].content) > 100_000  # more than a frame, and than half a window


async def test_the_text_protocol_passes_with_its_pushes(
    gateway: tuple[Runtime, str], tmp_path: Path, vendor_ports: None
) -> None:
    runtime, _ = gateway
    clock = runtime.clock
    assert isinstance(clock, LockstepClock)
    inbox = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    inbox.bind(("127.0.0.1", 40924))
    inbox.setblocking(False)
    async with connected(*gateway, tmp_path):
        reader, writer = await asyncio.open_connection(HERE, 40923)
        writer.write(b"command;chassis push position on;chassis speed x 0.3;")
        assert await reader.readuntil(b"ok;ok;ok;") == b"ok;ok;ok;"
        await clock.advance(0.5)
        assert (await pushed_by(inbox, HERE)).startswith(b"chassis push position")
        [action] = runtime.fleet.robots["a"].actions.running()
        assert action.identity == "cell"
        noted: set[str] = set()
        async with asyncio.timeout(60):
            while not noted:  # a thread writes it
                await asyncio.sleep(0.01)
                with open_trail(runtime.config.data) as trail:
                    noted = {entry.address for _, entry in trail.rows() if entry.operation == "chassis speed"}
        assert noted == {"127.0.0.1 by tunnel"}  # the client's address, not the tunnel's end
        writer.close()
    inbox.close()
    async with asyncio.timeout(60):
        while not action.status.ended:
            await clock.advance(0.1)
            await asyncio.sleep(0.01)


async def test_losing_the_tunnel_is_losing_the_client(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    runtime, _ = gateway
    clock = runtime.clock
    assert isinstance(clock, LockstepClock)
    async with connected(*gateway, tmp_path):
        reader, writer = await asyncio.open_connection(HERE, 40923)
        writer.write(b"command;chassis speed x 0.3;")
        assert await reader.readuntil(b"ok;ok;") == b"ok;ok;"
        [action] = runtime.fleet.robots["a"].actions.running()
    async with asyncio.timeout(60):
        while not action.status.ended:
            await clock.advance(0.1)
            await asyncio.sleep(0.01)
    assert await reader.read() == b""
    writer.close()


async def test_a_silent_end_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(heartbeat, "QUIET_AFTER", 0.01)
    monkeypatch.setattr(heartbeat, "LOST_AFTER", 0.3)
    writers: list[asyncio.StreamWriter] = []
    server = await asyncio.start_server(lambda _reader, writer: writers.append(writer), "127.0.0.1", 0)
    _, link = await asyncio.get_running_loop().create_connection(TunnelLink, *server.sockets[0].getsockname())
    quiet = asyncio.Event()

    async def refused(_port: int, _protocol: object) -> NoReturn:
        raise ConnectionRefusedError

    tunnel = carrying.Tunnel(
        link,
        first=1,
        opened=refused,
        datagram=lambda _port, _data: None,
        quiet=quiet.set,
    )
    with pytest.raises(carrying.TunnelLost, match="silent"):
        await tunnel.run()
    assert quiet.is_set()
    writers[0].close()
    server.close()


async def test_no_server_beside_client_is_reached_but_app(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    """An MQTT broker on the client's machine is none of the gateway's business."""
    runtime, _ = gateway
    assert runtime.guard is not None
    async with connected(*gateway, tmp_path):
        [own] = runtime.guard.tunnels
        for port in (1883, 7447):
            with pytest.raises(ConnectionRefusedError):
                await asyncio.open_connection(own, port)
        _, writer = await asyncio.open_connection(own, 8981)
        writer.close()


async def test_gateway_reaches_only_ports_the_client_allows(
    gateway: tuple[Runtime, str], tmp_path: Path, vendor_ports: None, caplog: pytest.LogCaptureFixture
) -> None:
    runtime, _ = gateway
    assert runtime.guard is not None
    loop = asyncio.get_running_loop()
    called = list[bytes]()

    class Inbox(asyncio.DatagramProtocol):
        def datagram_received(self, data: bytes, _: object) -> None:
            called.append(data)

    inbox, _ = await loop.create_datagram_endpoint(Inbox, ("127.0.0.1", 40924))
    app = await asyncio.start_server(lambda *_: called.append(b"a call"), "127.0.0.1", 8981)
    async with asyncio.timeout(60), connected(*gateway, tmp_path, apps=[40926]), app:
        [own] = runtime.guard.tunnels
        reader, writer = await asyncio.open_connection(own, 8981)
        assert await reader.read() == b""
        writer.close()
        runtime.fleet.robots["a"].tap.push("robomaster", f"{own}:40924", "push", b"x")
        while "port 40924" not in caplog.text:  # noqa: ASYNC110 - a few looks
            await asyncio.sleep(0.01)
    assert "port 8981 here: --callback 8981 allows it" in caplog.text
    assert called == []
    inbox.close()


async def test_strangers_get_no_tunnel(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    runtime, token = gateway
    with pytest.raises(Refused, match="is not valid"):
        async with connected(runtime, "wrong", tmp_path):
            pass
    with pytest.raises(Refused, match="no right"):
        async with connected(runtime, token, tmp_path, robot="b"):
            pass


async def test_a_revoked_token_ends_its_tunnel(gateway: tuple[Runtime, str], tmp_path: Path, data: Path) -> None:
    runtime, token = gateway
    async with connected(runtime, token, tmp_path):
        reader, writer = await asyncio.open_connection(HERE, 40923)
        other = open_store(data)
        other.revoke("cell")
        other.close()
        async with asyncio.timeout(60):
            assert await reader.read() == b""
        writer.close()
    with pytest.raises(Refused):
        async with connected(runtime, token, tmp_path):
            pass


def test_another_certificate_is_not_trusted(tmp_path: Path) -> None:
    known = KnownGateways(tmp_path / "gateways.json")
    fingerprint, new = known.check("gateway.example:50090", b"one")
    assert new
    assert known.check("gateway.example:50090", b"one") == (fingerprint, False)
    with pytest.raises(NotTrusted, match="another certificate"):
        known.check("gateway.example:50090", b"two")
    assert [path.name for path in tmp_path.iterdir()] == ["gateways.json"]
    (tmp_path / "gateways.json").write_text('{"gateway.exam')
    with pytest.raises(NotTrusted, match="cannot be read"):
        known.check("gateway.example:50090", b"one")


async def test_frames_of_strangers_end_the_connection(gateway: tuple[Runtime, str]) -> None:
    runtime, token = gateway
    hello = encode(FrameKind.HELLO, 0, json.dumps({"robot": "a", "token": token}).encode())
    for data in (
        b"GET / HTTP/1.1\r\n\r\n",
        encode(FrameKind.HELLO, 0, b"{}"),
        hello + encode(FrameKind.OPEN, 2, b"\0\1"),
    ):
        reader, writer = await dial(runtime)
        writer.write(data)
        async with asyncio.timeout(60):
            with contextlib.suppress(asyncio.IncompleteReadError, ConnectionError):
                while await next_kind(reader) in (FrameKind.WELCOME, FrameKind.PING, FrameKind.CLOSE):
                    pass
        writer.close()


@pytest.mark.slow
async def test_streams_opened_and_closed_hold_up_nobody(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    runtime, token = gateway
    hello = encode(FrameKind.HELLO, 0, json.dumps({"robot": "a", "token": token}).encode())
    flood = (
        encode(FrameKind.OPEN, number, (1448).to_bytes(2, "big")) + encode(FrameKind.CLOSE, number)
        for number in range(1, 2 * 20_000, 2)
    )
    reader, writer = await dial(runtime)
    async with asyncio.timeout(60):
        writer.write(hello)
        while await next_kind(reader) is not FrameKind.WELCOME:
            pass
        writer.write(b"".join(flood))
        while await next_kind(reader) is not FrameKind.CLOSE:  # the first that is turned away
            pass
    base = f"http://{HERE}:1448"
    async with connected(runtime, token, tmp_path), httpx.AsyncClient(base_url=base, verify=False) as client:
        assert (await client.get(POSE)).status_code == 200
    writer.transport.abort()


async def until(condition: Callable[[], object]) -> None:
    async with asyncio.timeout(60):
        while not condition():  # noqa: ASYNC110 - other tasks work on it
            await asyncio.sleep(0.01)


async def test_a_second_connection_carries_beats_and_comes_again(
    gateway: tuple[Runtime, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(connector, "BESIDE_AGAIN", 0.0)
    runtime, _ = gateway
    assert runtime._gateway is not None
    tunnels = runtime._gateway._tunnels
    async with connected(*gateway, tmp_path):
        [tunnel] = tunnels.values()
        await until(lambda: tunnel._beside)
        first, tunnel._heart._heard_beside = tunnel._beside, 0.0
        assert first is not None
        await until(lambda: tunnel._heart._heard_beside)  # a heartbeat has arrived by then
        first.end("lost on the way")
        await until(lambda: tunnel._beside not in (None, first))
        assert list(tunnels.values()) == [tunnel]
        second = tunnel._beside
    await until(lambda: not tunnels and second and second.lost.done())


async def test_other_programs_here_do_not_pass_for_tunnel(gateway: tuple[Runtime, str], tmp_path: Path) -> None:
    runtime, _ = gateway
    assert runtime.guard is not None
    async with connected(*gateway, tmp_path):
        [own] = runtime.guard.tunnels
        stranger = httpx.AsyncHTTPTransport(local_address=own, verify=False)
        async with httpx.AsyncClient(base_url=f"http://{ADDRESS}:1448", transport=stranger) as client:
            assert (await client.get(POSE)).status_code == 401


async def test_a_tunnel_takes_no_address_where_others_listen(
    gateway: tuple[Runtime, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    runtime, _ = gateway
    assert runtime.guard is not None
    first = ip_address(free_addresses(2))
    monkeypatch.setattr("roboglot.access.tunnel.gateway.FIRST_ADDRESS", first)
    with socket.create_server((str(first), 8981)):
        async with connected(*gateway, tmp_path):
            assert list(runtime.guard.tunnels) == [str(first + 1)]


@pytest.mark.parametrize(
    ("greeting", "kind"),
    [
        ({"beats": "0" * 32}, FrameKind.REFUSED),
        ({"beats": 7}, None),
        ({"robot": "a", "token": "no"}, FrameKind.REFUSED),
    ],
)
async def test_without_the_key_nothing_beats(
    gateway: tuple[Runtime, str], greeting: dict[str, object], kind: FrameKind | None
) -> None:
    runtime, _ = gateway
    reader, writer = await dial(runtime)
    writer.write(encode(FrameKind.HELLO, 0, json.dumps(greeting).encode()))
    async with asyncio.timeout(60):
        if kind is None:
            assert await reader.read() == b""
        else:
            assert await next_kind(reader) is kind
    writer.transport.abort()


async def test_a_gateway_that_closes_ends_handshakes(gateway: tuple[Runtime, str]) -> None:
    runtime, _ = gateway
    assert runtime._gateway is not None
    reader, writer = await asyncio.open_connection("127.0.0.1", runtime._gateway.port)
    while not runtime._gateway._transports:  # noqa: ASYNC110 - until it is accepted
        await asyncio.sleep(0.01)
    await runtime._gateway.close()
    with contextlib.suppress(ConnectionError):
        assert await asyncio.wait_for(reader.read(), 5.0) == b""
    writer.close()


async def test_a_connector_that_is_stopped_ends_its_handshake(tmp_path: Path) -> None:
    called: asyncio.Future[asyncio.StreamReader] = asyncio.get_running_loop().create_future()
    writers: list[asyncio.StreamWriter] = []

    def answer(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:  # with nothing
        writers.append(writer)
        called.set_result(reader)

    async with await asyncio.start_server(answer, "127.0.0.1", 0) as server:
        port = server.sockets[0].getsockname()[1]
        link = Connector("127.0.0.1", port, "a", "token", HERE, KnownGateways(tmp_path / "gateways.json"))
        running = asyncio.ensure_future(link.run(lambda *_: None))
        reader = await called
        running.cancel()
        with contextlib.suppress(ConnectionError):
            await asyncio.wait_for(reader.read(), 5.0)
        writers[0].close()


async def test_no_datagram_comes_before_the_welcome(
    gateway: tuple[Runtime, str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Robots announce themselves all the time, also while the gateway still opens ports for a tunnel."""
    runtime, token = gateway
    tap, listen, opened = runtime.fleet.robots["a"].tap, listening.listen, list[int]()

    async def while_announced(factory: Any, address: str, port: int) -> asyncio.Server:
        tap.push("robomaster", "255.255.255.255:40926", "> robot ip", b"robot ip 127.0.0.1")
        opened.append(port)
        return await listen(factory, address, port)

    monkeypatch.setattr("roboglot.access.tunnel.gateway.listen", while_announced)
    reader, writer = await dial(runtime)
    writer.write(encode(FrameKind.HELLO, 0, json.dumps({"robot": "a", "token": token}).encode()))
    assert await next_kind(reader) is FrameKind.WELCOME
    assert opened
    writer.close()
