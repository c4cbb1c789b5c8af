"""The proxy between client and robot: every byte passes, its meaning is recorded, and a full disk stops nothing."""

from __future__ import annotations

import asyncio
import contextlib
import re
import socket
import struct
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import grpc
import pytest
from typer.testing import CliRunner

from roboglot.cli.recordings import record
from roboglot.clients.robomaster.datagrams import BROADCAST_PORT
from roboglot.demo.clients.phone import Phone
from roboglot.demo.clients.slamware import SlamwareClient
from roboglot.model.tap import Direction
from roboglot.protocols.cyberdog.certificates import ensure_certificates, export_client
from roboglot.protocols.robomaster.datagrams import Datagrams
from roboglot.recording.lines import Target
from roboglot.recording.proxy.dog import DogRelay, Proof
from roboglot.recording.proxy.relay import ExchangeWriter, Relay
from roboglot.recording.proxy.sniffers import rest_operation
from roboglot.recording.reader import pair, read_recording
from roboglot.testing.addresses import free_addresses, free_port
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from tests.recording.test_playback import ADDRESS, PROGRAM, by_frames, by_rest, run

BETWEEN, ROBOT, OTHER = free_addresses(1), free_addresses(1), free_addresses(1)


async def between(url: str, path: Path, script: Any, sums: list[str] | None = None) -> Any:
    """Run a client against the relay, and return its result; ``sums`` gets the summary of delays."""
    writer = ExchangeWriter(path, Target(url), "0")
    relay = Relay(Target(url), BETWEEN, writer)
    await relay.open()
    try:
        return await script(BETWEEN)
    finally:
        await relay.close()
        writer.close()
        if sums is not None:
            sums.append(relay.watch.summary())


async def reading(address: str) -> list[tuple[float, ...]]:
    """Ask by REST, without a drive."""
    client = SlamwareClient(address)
    try:
        await client.wait_for_map()
        return [await client.pose() for _ in range(3)]
    finally:
        await client.close()


async def by_text(address: str) -> list[bytes]:
    reader, writer = await asyncio.open_connection(address, 40923)
    said = []
    for text in (b"command;", b"version;", b"chassis spe", b"ed ?;", b"x y;"):
        writer.write(text)
        if text.endswith(b";"):
            said.append(await reader.readuntil(b";"))
    writer.close()
    with contextlib.suppress(OSError):
        await writer.wait_closed()
    return said


@pytest.mark.parametrize(
    ("url", "script"),
    [
        (f"slamware://{ADDRESS}", reading),
        pytest.param(f"slamware://{ADDRESS}", by_rest, marks=pytest.mark.slow),
        (f"robomaster://{ADDRESS}", by_text),
        (f"visual://{ADDRESS}", by_frames),
    ],
    ids=["slamware", "slamware drive", "robomaster", "visual"],
)
async def test_proxy_and_the_robots_tap_agree(url: str, script: Any, tmp_path: Path) -> None:
    own, passed, sums = tmp_path / "own.mcap", tmp_path / "passed.mcap", list[str]()

    async def through(_: str) -> Any:
        return await between(url, passed, script, sums)

    assert await run(tmp_path, "universal", str(own), through)
    assert re.fullmatch(r"passing bytes on took ([\d.]+ ms \(\w.*\).*){2}, [\d.]+ and [\d.]+ ms .*processor", sums[0])
    door = Target(url).door
    sessions = [pair(read_recording(path).of(door=door))[0] for path in (own, passed)]
    reported, seen = (
        [(a.request.operation, a.request.payload, [(r.payload, r.status) for r in a.replies]) for a in session]
        for session in sessions
    )
    assert len(reported) >= 3
    assert seen == reported


@pytest.mark.slow  # in short: test_proxy_and_the_robots_tap_agree
async def test_a_phone_and_its_dog_do_not_notice(tmp_path: Path) -> None:
    own, passed, folder = tmp_path / "own.mcap", tmp_path / "passed.mcap", tmp_path / "data" / "cyberdog"
    proof, certificates, called = ensure_certificates(folder), tmp_path / "certificates", free_port()
    export_client(folder, certificates)
    target = Target(f"cyberdog://{ADDRESS}?certs={certificates}&app={called}")
    phone = Phone(BETWEEN, certificates)
    await phone.open()
    writer = ExchangeWriter(passed, target, "0")
    relay = DogRelay(target, BETWEEN, writer, Proof(proof.certificate, proof.key, proof.callers), phone.port)

    async def through(_: str) -> Any:
        await relay.open()
        try:
            return await phone.run(PROGRAM)  # the frames come as pushes
        finally:
            await relay.close()
            writer.close()

    try:
        said = await run(tmp_path, "cyberdog2", str(own), through, cyberdog={"app": f"127.0.0.1:{called}"})
    finally:
        await phone.close()
    assert said == ["one", "two"]
    assert relay.watch.delays
    assert min(relay.watch.delays) > 0
    asked, seen = (pair(read_recording(path).of(door="cyberdog"))[0] for path in (own, passed))
    assert [(a.request.operation, a.request.payload, [r.payload for r in a.replies]) for a in seen] == [
        (a.request.operation, a.request.payload, [r.payload for r in a.replies]) for a in asked
    ]
    pushes, beats = [], []
    for path in (own, passed):
        pushed = [e for e in read_recording(path).of(door="cyberdog") if e.direction is Direction.PUSH]
        pushes.append({e.payload for e in pushed if e.operation != HEARTBEAT})
        beats.append([e for e in pushed if e.operation == HEARTBEAT])
    assert pushes[1]
    assert pushes[1] <= pushes[0]
    assert beats[0][0].payload == beats[1][0].payload  # also of the one that found the app


async def test_client_that_looks_for_ep_finds_the_proxy(tmp_path: Path, vendor_ports: None) -> None:
    """The robot's address is not this machine's, so its broadcast comes from a socket that is bound to it."""
    path, found = tmp_path / "x.mcap", asyncio.get_running_loop().create_future()

    class Client(asyncio.DatagramProtocol):
        def datagram_received(self, data: bytes, addr: tuple[str, int]) -> None:
            if addr[0] == BETWEEN and not found.done():
                found.set_result(data)

    async def script(_: str) -> bytes:
        loop = asyncio.get_running_loop()
        client = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        client.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        client.bind(("", BROADCAST_PORT))
        hearing = (await loop.create_datagram_endpoint(Client, sock=client))[0]
        robot = Datagrams(ROBOT)
        other = Datagrams(OTHER)
        other.send(f"robot ip {OTHER};".encode(), "127.255.255.255", BROADCAST_PORT)
        robot.send(f"robot ip {ROBOT};".encode(), "127.255.255.255", BROADCAST_PORT)
        try:
            return await asyncio.wait_for(found, 60)
        finally:
            for socket_of in (hearing, robot, other):
                socket_of.close()

    assert await between(f"robomaster://{ROBOT}", path, script) == f"robot ip {BETWEEN};".encode()
    heard = read_recording(path).of(door="robomaster")
    assert [(e.direction, e.payload) for e in heard] == [(Direction.PUSH, f"robot ip {ROBOT};".encode())]


async def test_pushes_for_client_of_this_machine_are_noted(tmp_path: Path, vendor_ports: None) -> None:
    """Robot, proxy and client are all at home: the robot must not know the client's address."""
    path, push = tmp_path / "x.mcap", b"chassis push position 1 0 0;"
    heard: asyncio.Future[bytes] = asyncio.get_running_loop().create_future()

    class Client(asyncio.DatagramProtocol):
        def datagram_received(self, data: bytes, _addr: tuple[str, int]) -> None:
            if not heard.done():
                heard.set_result(data)

    async def robot(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        await reader.readuntil(b";")
        datagrams = Datagrams(ROBOT)
        datagrams.send(push, writer.get_extra_info("peername")[0], 40924)
        datagrams.close()
        await reader.read()
        writer.close()

    async def script(address: str) -> bytes:
        loop = asyncio.get_running_loop()
        hearing = (await loop.create_datagram_endpoint(Client, local_addr=("127.0.0.1", 40924)))[0]
        _, writer = await asyncio.open_connection(address, 40923, local_addr=("127.0.0.1", 0))
        writer.write(b"command;")
        try:
            return await asyncio.wait_for(heard, 60)
        finally:
            writer.close()
            hearing.close()

    async with await asyncio.start_server(robot, ROBOT, 40923):
        assert await between(f"robomaster://{ROBOT}", path, script) == push
    noted = read_recording(path).of(door="robomaster")
    assert push in [exchange.payload for exchange in noted if exchange.direction is Direction.PUSH]


async def test_full_disk_stops_the_recording_but_no_client(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    async def through(_: str) -> Any:
        monkeypatch.setattr("roboglot.recording.files.PartWriter.write", full)
        return await between(f"robomaster://{ADDRESS}", tmp_path / "x.mcap", by_text)

    said = await run(tmp_path, "universal", "", through)
    assert said[0] == b"ok;"


async def test_unreadable_bytes_are_passed_on(tmp_path: Path) -> None:
    ended = asyncio.Event()

    async def echo(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        with contextlib.suppress(OSError):
            while data := await reader.read(1 << 16):
                writer.write(data)
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
        ended.set()

    robot = await asyncio.start_server(echo, ROBOT, 1448)
    sent = bytes(range(256)) * 2000

    async def script(address: str) -> bytes:
        reader, writer = await asyncio.open_connection(address, 1448)
        writer.write(sent)
        came = await reader.readexactly(len(sent))
        writer.close()
        with contextlib.suppress(OSError):
            await writer.wait_closed()
        return came

    assert await between(f"slamware://{ROBOT}", tmp_path / "x.mcap", script) == sent
    await ended.wait()
    robot.close()
    await robot.wait_closed()


async def test_client_learns_that_robot_hung_up_at_once(tmp_path: Path) -> None:
    """The robot is gone before the two connections are joined."""

    async def refuse(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        writer.transport.abort()

    async def script(address: str) -> list[bytes]:
        came = []
        for _ in range(20):
            reader, writer = await asyncio.open_connection(address, 40923)
            try:
                came.append(await reader.read())
            except ConnectionResetError:
                came.append(b"")
            writer.close()
        return came

    async with await asyncio.start_server(refuse, ROBOT, 40923):
        assert await between(f"robomaster://{ROBOT}", tmp_path / "x.mcap", script) == [b""] * 20


def test_a_request_is_named_as_in_the_contract() -> None:
    assert rest_operation("GET", "/api/core/slam/v1/localization/pose?x=1") == "GET /api/core/slam/v1/localization/pose"
    assert rest_operation("GET", "/api/core/motion/v1/actions/7").startswith("GET /api/core/motion/v1/actions/{")
    assert rest_operation("GET", "/nowhere") == ""


REFUSED = pb.SendRequest(nameCode=10001, params="refuse").SerializeToString()
UNREADABLE = b"\xff\xff\xff\xff not of the service"


async def test_dog_s_message_that_cannot_be_read_passes(tmp_path: Path) -> None:
    """Requests, answers, pushes and heartbeats are bytes to the proxy; what it cannot read is noted as it is."""
    path, heard, (robot_port, app_port, called) = tmp_path / "x.mcap", list[bytes](), (free_port() for _ in range(3))

    async def stream(request: bytes, context: grpc.aio.ServicerContext) -> AsyncIterator[bytes]:
        heard.append(request)
        if b"refuse" in request:
            await context.abort(grpc.StatusCode.RESOURCE_EXHAUSTED, "too many")
        yield UNREADABLE + b" answer"

    async def beat(request: bytes, _context: object) -> bytes:
        heard.append(request)
        return UNREADABLE + b" answer"

    async def serve(where: str) -> grpc.aio.Server:
        methods = {
            "sendMsg": grpc.unary_stream_rpc_method_handler(stream),
            "heartbeat": grpc.unary_unary_rpc_method_handler(beat),
        }
        server = grpc.aio.server(options=[("grpc.so_reuseport", 0)])
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("grpcapi.GrpcApp", methods),))
        assert server.add_insecure_port(where)
        await server.start()
        return server

    target = Target(f"cyberdog://{ADDRESS}:{robot_port}?certs=none&app={called}")
    writer = ExchangeWriter(path, target, "0")
    ends = [await serve(f"{ADDRESS}:{robot_port}"), await serve(f"127.0.0.1:{app_port}")]
    relay = DogRelay(target, BETWEEN, writer, None, app_port)
    await relay.open()
    try:
        async with (
            grpc.aio.insecure_channel(f"{BETWEEN}:{robot_port}") as phone,
            grpc.aio.insecure_channel(f"127.0.0.1:{called}") as dog,
        ):
            asked = [answer async for answer in phone.unary_stream("/grpcapi.GrpcApp/sendMsg")(UNREADABLE + b" 1")]
            with pytest.raises(grpc.aio.AioRpcError):
                [_ async for _ in phone.unary_stream("/grpcapi.GrpcApp/sendMsg")(REFUSED)]
            pushed = [answer async for answer in dog.unary_stream("/grpcapi.GrpcApp/sendMsg")(UNREADABLE + b" 2")]
            beaten = await dog.unary_unary("/grpcapi.GrpcApp/heartbeat")(UNREADABLE + b" 3")
    finally:
        await relay.close()
        writer.close()
        await asyncio.gather(*(end.stop(None) for end in ends))
    assert heard == [UNREADABLE + b" 1", REFUSED, UNREADABLE + b" 2", UNREADABLE + b" 3"]
    refused = pair(read_recording(path).of(door="cyberdog"))[0][1]
    assert [(reply.payload, reply.status) for reply in refused.replies] == [(b"", "error RESOURCE_EXHAUSTED")]
    assert [*asked, *pushed, beaten] == [UNREADABLE + b" answer"] * 3
    assert UNREADABLE + b" answer" in [exchange.payload for exchange in read_recording(path).of(door="cyberdog")]


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("--listen", "203.0.113.1", "--to", "new.mcap"), "cannot listen on 203.0.113.1:1448: it is not"),
        (("--listen", BETWEEN, "--to", "there.mcap"), "there.mcap exists already; --to names a new file"),
        (("--listen", BETWEEN, "--to", "nowhere/new.mcap"), "nowhere/new.mcap: No such file or directory"),
    ],
)
def test_failed_start_leaves_no_file(
    words: tuple[str, ...], why: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.mcap").write_bytes(b"kept")
    done = CliRunner().invoke(record.app, [f"slamware://{ADDRESS}", *words])
    assert why in str(done.exception) + done.output
    assert "Errno" not in str(done.exception)
    assert [path.read_bytes() for path in tmp_path.iterdir()] == [b"kept"]


async def test_an_early_end_of_requests_is_passed_on(tmp_path: Path) -> None:
    async def robot(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writer.write(b"heard " + await reader.read())
        writer.close()

    async def ask(address: str) -> bytes:
        reader, writer = await asyncio.open_connection(address, 1448)
        writer.write(b"all")
        writer.write_eof()
        answer = await reader.read()
        writer.close()
        return answer

    server = await asyncio.start_server(robot, ROBOT, 1448)
    try:
        assert await between(f"slamware://{ROBOT}", tmp_path / "x.mcap", ask) == b"heard all"
    finally:
        server.close()
