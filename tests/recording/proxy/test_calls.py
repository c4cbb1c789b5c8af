"""A dog's proxy: gRPC is read from the bytes that pass, however they are cut, and TLS proves both ends."""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import ssl
from pathlib import Path

import pytest
from hpack import Encoder
from hypothesis import given
from hypothesis import strategies as st

from roboglot.protocols.cyberdog.certificates import CLIENT_FILES, ensure_certificates, export_client
from roboglot.recording.lines import Target
from roboglot.recording.proxy.calls import PREFACE, Call, Flag, Http2Frame, both
from roboglot.recording.proxy.dog import DogRelay, Proof
from roboglot.recording.proxy.relay import ExchangeWriter
from roboglot.testing.addresses import free_port
from roboglot.wire.cyberdog.channel import ROBOT_NAME
from tests.recording.proxy.test_relay import BETWEEN

ASKED = [b"", b"one", bytes(range(256)) * 200]
STATUSES = [0, 14, 7]
ANSWERED = [b"yes", b"no" * 30_000]


def frame(kind: Http2Frame, flags: int, stream: int, payload: bytes) -> bytes:
    return len(payload).to_bytes(3) + bytes((kind, flags)) + stream.to_bytes(4) + payload


def data(stream: int, message: bytes, *, last: bool, packed: bool) -> bytes:
    """Return a message in frames of at most 16 KiB, each with padding."""
    body = gzip.compress(message) if packed else message
    whole = bytes((packed,)) + len(body).to_bytes(4) + body
    pieces = [whole[at : at + 16_000] for at in range(0, len(whole), 16_000)]
    return b"".join(
        frame(
            Http2Frame.DATA,
            Flag.PADDED | (Flag.END_STREAM if last and piece is pieces[-1] else 0),
            stream,
            b"\x03" + piece + b"\0\0\0",
        )
        for piece in pieces
    )


def headers(encoder: Encoder, stream: int, fields: list[tuple[str, str]], *, last: bool = False) -> bytes:
    """Headers in two frames, the first with a priority."""
    block = encoder.encode(fields)
    half = len(block) // 2
    first = frame(Http2Frame.HEADERS, Flag.PRIORITY | (Flag.END_STREAM if last else 0), stream, bytes(5) + block[:half])
    return first + frame(Http2Frame.CONTINUATION, Flag.END_HEADERS, stream, block[half:])


def conversation(*, packed: bool) -> tuple[bytes, bytes]:
    """Bytes of a caller and of the called, of a call for each message; the robot allows a larger header table."""
    asking, answering = Encoder(), Encoder()
    table = 1 << 16
    asks, answers = bytearray(PREFACE), bytearray(frame(Http2Frame.SETTINGS, 0, 0, b"\0\1" + table.to_bytes(4)))
    asking.header_table_size = table
    encoding = [("grpc-encoding", "gzip")] if packed else []
    for number, message in enumerate(ASKED):
        stream = 2 * number + 1
        asks += headers(asking, stream, [(":method", "POST"), (":path", f"/a/{number}"), *encoding])
        asks += data(stream, message, last=True, packed=packed)
        answers += headers(answering, stream, [(":status", "200"), *encoding])
        for answer in ANSWERED:
            answers += data(stream, answer, last=False, packed=packed)
        answers += headers(answering, stream, [("grpc-status", str(STATUSES[number]))], last=True)
    return bytes(asks), bytes(answers)


def cut(whole: bytes, lengths: list[int]) -> list[bytes]:
    """Pieces of these lengths, then the rest."""
    pieces = []
    for length in lengths:
        pieces.append(whole[:length])
        whole = whole[length:]
    return [*pieces, whole]


@pytest.mark.parametrize("packed", [False, True])
@given(lengths=st.lists(st.integers(1, 5000), max_size=40))
def test_calls_are_read_however_they_are_cut(packed: bool, lengths: list[int]) -> None:
    heard: list[tuple[str, bytes]] = []

    def note(call: Call, message: bytes) -> None:
        heard.append((call.path, message))

    ends: list[tuple[str, int]] = []
    asking, answering = both(note, note, lambda call, status: ends.append((call.path, status)))
    asks, answers = conversation(packed=packed)
    answering.feed(answers[:15])  # a server's settings come first
    for piece in cut(asks, lengths):
        asking.feed(piece)
    assert heard == [(f"/a/{number}", message) for number, message in enumerate(ASKED)]
    heard.clear()
    for piece in cut(answers[15:], lengths):
        answering.feed(piece)
    assert heard == [(f"/a/{number}", message) for number in range(len(ASKED)) for message in ANSWERED]
    assert ends == [(f"/a/{number}", status) for number, status in enumerate(STATUSES)]


@pytest.mark.parametrize(("reset", "status"), [(8, [1]), (7, [14]), (2, [13])])
def test_reset_by_the_robot_is_an_end(reset: int, status: list[int]) -> None:
    ends: list[int] = []
    for breaks in ("app", "robot"):
        asking, answering = both(lambda *_: None, lambda *_: None, lambda _, ended: ends.append(ended))
        asks, answers = conversation(packed=False)
        answering.feed(answers[:15])  # a server's settings
        asking.feed(asks)
        (asking if breaks == "app" else answering).feed(frame(Http2Frame.RST_STREAM, 0, 1, reset.to_bytes(4)))
    assert ends == status, "an app that goes gets no answer"


@given(st.binary(min_size=1, max_size=400))
def test_nothing_but_known_errors_come_of_noise(noise: bytes) -> None:
    asking, answering = both(*[lambda _call, _message: None] * 3)
    for way, before in ((asking, PREFACE), (answering, b"")):
        with contextlib.suppress(Exception):  # the relay takes any, and goes on passing
            way.feed(before + noise)


def app(folder: Path, *, proved: bool) -> ssl.SSLContext:
    """Return an app's TLS, with or without its certificate."""
    ca, certificate, key = (folder / name for name in CLIENT_FILES)
    context = ssl.create_default_context(cafile=str(ca))
    if proved:
        context.load_cert_chain(certificate, key)
    return context


@pytest.mark.parametrize(
    ("proved", "known", "passes"),
    [(True, True, True), (False, True, False), (True, False, False)],
    ids=["both prove themselves", "an app without a certificate", "a robot of another house"],
)
async def test_unproved_ends_are_hung_up_on(proved: bool, known: bool, passes: bool, tmp_path: Path) -> None:
    house, other, port = tmp_path / "house", tmp_path / "other", free_port()
    proof = ensure_certificates(house)
    export_client(house, tmp_path / "app")
    export_client(house if known else other, tmp_path / "believed")
    heard: list[bytes] = []

    async def robot(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        heard.append(await reader.read(100))
        writer.write(b"from the robot")
        writer.close()

    context = ssl.SSLContext(ssl.PROTOCOL_TLS_SERVER)
    context.load_cert_chain(house / "tls" / "server-cert.pem", house / "tls" / "server-key.pem")
    server = await asyncio.start_server(robot, "127.0.0.1", port, ssl=context)
    target = Target(f"cyberdog://127.0.0.1:{port}?certs={tmp_path / 'believed'}&app={free_port()}")
    exchanges = ExchangeWriter(tmp_path / "x.mcap", target, "0")
    relay = DogRelay(target, BETWEEN, exchanges, Proof(proof.certificate, proof.key, proof.callers))
    await relay.open()
    came = b""
    try:
        reader, writer = await asyncio.open_connection(
            BETWEEN, port, ssl=app(tmp_path / "app", proved=proved), server_hostname=ROBOT_NAME
        )
        with contextlib.suppress(ConnectionError, ssl.SSLError):
            writer.write(b"from the app")
            came = await reader.read(100)
        writer.close()
        with contextlib.suppress(ConnectionError, ssl.SSLError):
            await writer.wait_closed()
    finally:
        await relay.close()
        exchanges.close()
        server.close()
    assert (heard, came) == (([b"from the app"], b"from the robot") if passes else ([], b""))
