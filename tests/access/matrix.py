"""The eight callers of the access matrix, and what each door answers them."""

from __future__ import annotations

import asyncio
import json
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import grpc
from websockets.asyncio.client import connect
from websockets.exceptions import InvalidStatus
from websockets.typing import Subprotocol

from roboglot.access.rights import NOTHING, effective
from roboglot.clients.visual import TextLink
from roboglot.operations import Right
from roboglot.protocols.cyberdog.certificates import export_app
from roboglot.testing.addresses import free_addresses
from roboglot.wire.cyberdog.channel import ROBOT_NAME
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb
from roboglot.wire.cyberdog.proto.cyberdog_app_pb2_grpc import GrpcAppStub

ADDRESS = free_addresses(1)


SUBPROTOCOL = Subprotocol("foxglove.websocket.v1")


@dataclass(frozen=True, slots=True)
class Caller:
    """Client with its loopback address, and its rights on robot a."""

    name: str
    address: str
    rights: frozenset[Right]


CALLERS = (
    Caller("unknown", "127.0.95.1", NOTHING),
    *(Caller(right, f"127.0.95.{number}", effective([right])) for number, right in enumerate(Right, 2)),
    Caller("revoked", "127.0.95.10", NOTHING),
    Caller("owner-of-b", "127.0.95.11", NOTHING),
)


class HttpCaller:
    """Requests of HTTP from a given address, one after another; a library's client takes longer than the server."""

    def __init__(self, caller: str, host: str, port: int) -> None:
        self._caller, self._host, self._port = caller, host, port
        self._link: tuple[asyncio.StreamReader, asyncio.StreamWriter] | None = None

    async def status(self, method: str, path: str, body: bytes = b"") -> int:
        """Return the status of the answer."""
        if self._link is None:
            local = (self._caller, 0)
            self._link = await asyncio.open_connection(self._host, self._port, local_addr=local)
        reader, writer = self._link
        head = f"{method} {path} HTTP/1.1\r\nhost: {self._host}:{self._port}\r\ncontent-length: {len(body)}\r\n\r\n"
        writer.write(head.encode() + body)
        first, *lines = (await reader.readuntil(b"\r\n\r\n")).decode("latin-1").lower().split("\r\n")
        headers = dict(line.split(": ", 1) for line in lines if line)
        await reader.readexactly(int(headers.get("content-length", 0)))
        if headers.get("connection") == "close":
            self.close()
        return int(first.split()[1])

    def close(self) -> None:
        if self._link is not None:
            self._link[1].close()
            self._link = None


async def rest_status(client: HttpCaller, key: str) -> int:
    """Return the HTTP status of an operation's answer; names in the braces of its path are filled in."""
    method, path = key.split(" ", 1)
    filled = "/".join("1" if part.startswith("{") else part for part in path.split("/"))
    return await client.status(method, filled, b"{}" if method in ("POST", "PUT") else b"")


class TextCaller:
    """A connection of the text protocol from a given address; ``closed`` if it was hung up on."""

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self._reader, self._writer = reader, writer

    @classmethod
    async def open(cls, address: str) -> TextCaller:
        return cls(*await asyncio.open_connection(ADDRESS, 40923, local_addr=(address, 0)))

    async def ask(self, command: str) -> bytes:
        """Return the answer; empty: the connection was closed."""
        try:
            self._writer.write(f"{command};".encode())
            return await self._reader.readuntil(b";")
        except (asyncio.IncompleteReadError, ConnectionError):
            return b""

    def close(self) -> None:
        self._writer.close()


async def dog_answers(
    folder: Path, name: str, codes: list[int], params: str = "{}"
) -> dict[int, list[dict[str, object]]]:
    """Return the answers to the codes for the app with the certificate of ``name``."""
    answers: dict[int, list[dict[str, object]]] = {}
    async with app_of(folder, name) as stub:
        for code in codes:
            stream = stub.sendMsg(pb.SendRequest(nameCode=code, params=params), timeout=60.0)
            answers[code] = [json.loads(message.data) async for message in stream if message.data.startswith("{")]
    return answers


@asynccontextmanager
async def app_of(folder: Path, name: str) -> AsyncIterator[GrpcAppStub]:
    """Yield the calls of the app with the certificate of ``name``."""
    ca, certificate, key = (path.read_bytes() for path in export_app(folder, name, folder / f"app-{name}"))
    credentials = grpc.ssl_channel_credentials(ca, key, certificate)
    options = [("grpc.ssl_target_name_override", ROBOT_NAME)]
    async with grpc.aio.secure_channel(f"{ADDRESS}:50052", credentials, options=options) as channel:
        yield GrpcAppStub(channel)


async def dog_file_errors(folder: Path, name: str, asked: list[tuple[int, dict[str, object]]]) -> list[int]:
    """Return the error that ends each ``getFile``, for the app with the certificate of ``name``."""
    async with app_of(folder, name) as stub:
        errors = []
        for code, params in asked:
            stream = stub.getFile(pb.SendRequest(nameCode=code, params=json.dumps(params)), timeout=60.0)
            errors.append([chunk.error_code async for chunk in stream][-1])
    return errors


async def open_frames(address: str) -> TextLink | None:
    """Return a link of the frames from an address; None: it was refused."""
    try:
        connection = await connect(f"ws://{ADDRESS}:50053/programs", compression=None, local_addr=(address, 0))
    except InvalidStatus:
        return None
    return TextLink(connection)


async def frame_states(link: TextLink, frames: list[dict[str, object]]) -> list[tuple[object, str]]:
    """Return the state and the message of the answer to each frame."""
    states: list[tuple[object, str]] = []
    for number, frame in enumerate(frames):
        await link.send(json.dumps({"id": f"f{number}", **frame}))
        async for text in link:
            answer = json.loads(text)
            body = answer.get("feedback") or answer["response"]
            if body["id"] == f"f{number}":
                states.append((body.get("state", 0), body.get("describe", "")))
                break
    return states


async def viewer_refusals(address: str, keys: list[str]) -> int | None:
    """Return how many of a viewer's messages are refused for want of a right (Foxglove); None: not let in."""
    try:
        link = await connect(
            f"ws://{ADDRESS}:8765/", compression=None, local_addr=(address, 0), subprotocols=[SUBPROTOCOL]
        )
    except InvalidStatus:
        return None
    for key in keys:
        await link.send(b"\x01\0\0\0\0" if key == "messageData" else json.dumps({"op": key}))
    await link.send("the end")
    refused = 0
    async for text in link:
        words = text if isinstance(text, str) else ""
        refused += "has no right to" in words
        if "a message is a JSON object" in words:
            break
    await link.close()
    return refused
