"""Both ends of gRPC over HTTP/2 and TLS, with prepared bytes, so that a benchmark's clients cost little.

Real frames to and from a real gRPC: but each call has one request, its headers are always the same ones, and answers'
headers are not read: a call without a message counts as refused. Flow control is opened wide once.
"""

from __future__ import annotations

import asyncio
import ssl
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import cast

from roboglot.clients.cyberdog import Certificates
from roboglot.wire.cyberdog.channel import ROBOT_NAME

PREFACE = b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n"
DATA, HEADERS, RESET, SETTINGS, PING, GOAWAY, WINDOW = 0, 1, 3, 4, 6, 7, 8
END, ACK, WHOLE = 1, 1, 4  # flags: of a stream, of an answer to a frame, of headers
WIDE = (1 << 31) - 1 - 65535  # more bytes than a run takes
SEND_MSG = b"/grpcapi.GrpcApp/sendMsg"


def frame(kind: int, flags: int, stream: int, body: bytes = b"") -> bytes:
    """Return a frame of HTTP/2."""
    return len(body).to_bytes(3, "big") + bytes((kind, flags)) + stream.to_bytes(4, "big") + body


def _field(name: bytes, value: bytes) -> bytes:
    """Return a header that enters no table; ``name``: its form in HPACK."""
    return name + bytes((len(value),)) + value


def _name(name: bytes) -> bytes:
    return b"\0" + bytes((len(name),)) + name


OPENING = frame(SETTINGS, 0, 0, b"\0\x04" + WIDE.to_bytes(4, "big")) + frame(WINDOW, 0, 0, WIDE.to_bytes(4, "big"))
KIND = _field(b"\x0f\x10", b"application/grpc")
CALL = b"\x83\x87" + _field(b"\x04", SEND_MSG) + _field(b"\x01", ROBOT_NAME.encode()) + KIND
CALL += _field(_name(b"te"), b"trailers")  # POST, https
FOUND = b"\x88" + KIND  # 200
FINE = _field(_name(b"grpc-status"), b"0")


def message(body: bytes) -> bytes:
    """Return a message of gRPC."""
    return b"\0" + len(body).to_bytes(4, "big") + body


class _Line(asyncio.Protocol):
    """One end of a connection."""

    transport: asyncio.Transport
    opening = OPENING

    def __init__(self) -> None:
        self._rest = b""
        self._messages: dict[int, bytes] = {}

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = cast(asyncio.Transport, transport)
        self.transport.write(self.opening)

    def data_received(self, data: bytes) -> None:
        said = list[bytes]()
        for kind, flags, stream, body in self._frames(data):
            if kind == DATA:
                self._messages[stream] = self._messages.get(stream, b"") + body
            if kind in (DATA, HEADERS) and flags & END:
                said.append(self.ended(stream, self._messages.pop(stream, b"")))
            elif kind == RESET:
                said.append(self.ended(stream, b""))
            elif kind in (SETTINGS, PING) and not flags & ACK:
                said.append(frame(kind, ACK, 0, body if kind == PING else b""))
            elif kind == GOAWAY:
                self.transport.close()
        if answer := b"".join(said):
            self.transport.write(answer)

    def _frames(self, data: bytes) -> Iterator[tuple[int, int, int, bytes]]:
        data, at = self._rest + data, 0
        while len(data) - at >= 9 and len(data) - at - 9 >= (size := int.from_bytes(data[at : at + 3], "big")):
            stream = int.from_bytes(data[at + 5 : at + 9], "big")
            yield data[at + 3], data[at + 4], stream, data[at + 9 : at + 9 + size]
            at += 9 + size
        self._rest = data[at:]

    def ended(self, stream: int, said: bytes) -> bytes:
        """Note what the other end said on a stream; return what to send."""
        raise NotImplementedError


class Caller(_Line):
    """Calls ``sendMsg``."""

    opening = PREFACE + OPENING

    def __init__(self) -> None:
        super().__init__()
        self._stream = -1
        self._asked: dict[int, asyncio.Future[bytes]] = {}

    def ask(self, request: bytes) -> asyncio.Future[bytes]:
        """Send a request; return the messages of the answer, one behind the other."""
        self._stream += 2
        answer = self._asked[self._stream] = asyncio.get_running_loop().create_future()
        self.transport.write(
            frame(HEADERS, WHOLE, self._stream, CALL) + frame(DATA, END, self._stream, message(request))
        )
        return answer

    def ended(self, stream: int, said: bytes) -> bytes:
        if (answer := self._asked.pop(stream, None)) is not None and not answer.done():
            answer.set_result(said)
        return b""

    def connection_lost(self, _exc: Exception | None) -> None:
        for answer in self._asked.values():
            answer.cancel()


class Served(_Line):
    """The other end of a connection: ``answer`` takes a request and returns the message in answer to it."""

    def __init__(self, answer: Callable[[bytes], bytes]) -> None:
        super().__init__()
        self._answer = answer
        self._rest = b""
        self._greeted = False

    def data_received(self, data: bytes) -> None:
        if not self._greeted:
            self._rest += data
            if len(self._rest) < len(PREFACE):
                return
            self._greeted, data, self._rest = True, self._rest[len(PREFACE) :], b""
        super().data_received(data)

    def ended(self, stream: int, said: bytes) -> bytes:
        data = message(self._answer(said[5:]))
        return (
            frame(HEADERS, WHOLE, stream, FOUND)
            + frame(DATA, 0, stream, data)
            + frame(HEADERS, WHOLE | END, stream, FINE)
        )


def secured(proof: Certificates, side: int) -> ssl.SSLContext:
    """Return the settings of TLS at one ``side`` (``ssl.PROTOCOL_TLS_…``), with proof at both."""
    context = ssl.SSLContext(side)
    context.set_alpn_protocols(["h2"])
    context.verify_mode = ssl.CERT_REQUIRED
    context.load_verify_locations(cadata=proof.ca.decode())
    with tempfile.TemporaryDirectory() as folder:
        key, certificate = Path(folder) / "key", Path(folder) / "certificate"
        key.write_bytes(proof.key)
        certificate.write_bytes(proof.certificate)
        context.load_cert_chain(certificate, key)
    return context


async def call(address: str, proof: ssl.SSLContext) -> Caller:
    """Connect to a robot."""
    loop = asyncio.get_running_loop()
    return (await loop.create_connection(Caller, address, 50052, ssl=proof, server_hostname=ROBOT_NAME))[1]


async def serve(where: str, proof: ssl.SSLContext, answer: Callable[[bytes], bytes]) -> asyncio.Server:
    """Listen on host:port."""
    host, _, port = where.rpartition(":")
    return await asyncio.get_running_loop().create_server(lambda: Served(answer), host, int(port), ssl=proof)
