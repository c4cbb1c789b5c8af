"""A phone's app for tests: its calls to the robot and its own server, made from nothing but the .proto file."""

from __future__ import annotations

import asyncio
import json
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import grpc
from google.protobuf import descriptor_pb2, descriptor_pool, message_factory
from grpc_tools import protoc

import roboglot.wire.cyberdog.proto as proto
from roboglot.protocols.cyberdog.context import Context
from roboglot.protocols.cyberdog.server import CyberDogDoor
from roboglot.testing import Forward
from tests.drivers.settling import settle

ADDRESS = "127.0.0.17"
PHONE = "127.0.0.1"  # apparent address of clients on this machine
DOCS = Path(__file__).parents[3] / "docs" / "protocols"
EXAMPLE = re.compile(r"^\$ask (\d+)(?: '(.*)')?  #(.*)$", re.MULTILINE)
PATIENCE = 60.0  # real seconds; reached only on a busy machine


class Messages:
    """The classes of the service's messages, made from the .proto in a separate pool."""

    def __init__(self, folder: Path) -> None:
        source = Path(proto.__file__).parent
        out = folder / "service.bin"
        assert protoc.main(["protoc", f"-I{source}", f"--descriptor_set_out={out}", "cyberdog_app.proto"]) == 0
        files = descriptor_pb2.FileDescriptorSet.FromString(out.read_bytes())
        pool = descriptor_pool.DescriptorPool()
        for file in files.file:
            pool.Add(file)
        for name in ("SendRequest", "RecResponse", "Ticks", "Result", "FileChunk"):
            setattr(self, name, message_factory.GetMessageClass(pool.FindMessageTypeByName(f"grpcapi.{name}")))

    def __getattr__(self, name: str) -> Any:
        raise AttributeError(name)


class Client:
    """An app's calls to the robot."""

    def __init__(self, channel: grpc.aio.Channel, messages: Messages) -> None:
        self._channel, self._messages = channel, messages
        serialize = messages.SendRequest.SerializeToString
        self._send = channel.unary_stream(
            "/grpcapi.GrpcApp/sendMsg",
            request_serializer=serialize,
            response_deserializer=messages.RecResponse.FromString,
        )
        self._file = channel.unary_stream(
            "/grpcapi.GrpcApp/getFile",
            request_serializer=serialize,
            response_deserializer=messages.FileChunk.FromString,
        )
        self._heartbeat = channel.unary_unary(
            "/grpcapi.GrpcApp/heartbeat",
            request_serializer=messages.Ticks.SerializeToString,
            response_deserializer=messages.Result.FromString,
        )

    def open(self, code: int, params: object = None) -> Any:
        text = params if isinstance(params, str) else json.dumps(params or {})
        return self._send(self._messages.SendRequest(nameCode=code, params=text))

    async def raw(self, code: int, params: object = None) -> list[tuple[int, str]]:
        """Return all answers: (nameCode, data)."""
        async with asyncio.timeout(PATIENCE):
            return [(answer.nameCode, answer.data) async for answer in self.open(code, params)]

    async def ask(self, code: int, params: object = None) -> Any:
        """Return the one answer, which carries the request's code."""
        ((name, data),) = await self.raw(code, params)
        assert name == code
        return json.loads(data) if data else data

    def fetch(self, code: int, params: object = None) -> Any:
        return self._file(self._messages.SendRequest(nameCode=code, params=json.dumps(params or {})))

    async def file(self, code: int, params: object = None) -> list[Any]:
        async with asyncio.timeout(4 * PATIENCE):
            return [chunk async for chunk in self.fetch(code, params)]

    async def send(self, method: str, request: bytes) -> list[bytes]:
        """Return the answers to these bytes, as they come."""
        async with asyncio.timeout(PATIENCE):
            return [answer async for answer in self._channel.unary_stream(f"/grpcapi.GrpcApp/{method}")(request)]

    async def heartbeat(self) -> None:
        async with asyncio.timeout(PATIENCE):
            await self._heartbeat(self._messages.Ticks())


@dataclass
class App:
    """A phone's end: answers heartbeats and keeps what is pushed."""

    messages: Messages
    port: int = 0
    ticks: list[Any] = field(default_factory=list)
    pushed: list[tuple[int, str]] = field(default_factory=list)
    silent: bool = False
    refusing: bool = False  # answers pushes with an error
    gate: asyncio.Event = field(default_factory=asyncio.Event)  # it answers pushes only while this is set
    slowness: float = 0.0  # s of the machine's time for each push, in turn
    robot: CyberDogDoor | None = None  # dials this app
    _busy: asyncio.Lock = field(default_factory=asyncio.Lock)
    _server: Any = None

    async def start(self, credentials: grpc.ServerCredentials, port: int = 0) -> None:
        self.gate.set()
        messages = self.messages
        handlers = {
            "heartbeat": grpc.unary_unary_rpc_method_handler(
                self._heartbeat, messages.Ticks.FromString, messages.Result.SerializeToString
            ),
            "sendMsg": grpc.unary_stream_rpc_method_handler(
                self._push, messages.SendRequest.FromString, messages.RecResponse.SerializeToString
            ),
        }
        self._server = grpc.aio.server(options=[("grpc.so_reuseport", 0)])
        self._server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler("grpcapi.GrpcApp", handlers),))
        self.port = self._server.add_secure_port(f"{PHONE}:{port}", credentials)
        await self._server.start()

    async def stop(self) -> None:
        await self._server.stop(None)

    async def _heartbeat(self, request: Any, context: Any) -> Any:
        if self.silent:
            await context.abort(grpc.StatusCode.UNAVAILABLE, "the phone sleeps")
        self.ticks.append(request)
        return self.messages.Result(result="ok")

    async def _push(self, request: Any, context: Any) -> AsyncIterator[Any]:
        if self.refusing:
            await context.abort(grpc.StatusCode.INTERNAL, "a bug")
        self.pushed.append((request.nameCode, request.params))
        await self.gate.wait()
        if self.slowness:
            async with self._busy:
                await asyncio.sleep(self.slowness)
        yield self.messages.RecResponse(nameCode=request.nameCode, data="{}")

    @property
    def connected(self) -> bool:
        """True once the robot has heard this app's answer, and pushes; a heartbeat that is still here comes before."""
        return self.robot is not None and context_of(self.robot).app.connected

    def of(self, code: int) -> list[Any]:
        """Return the pushes under ``code``."""
        return [_read(text) for name, text in self.pushed if name == code]


@lru_cache(4096)
def _read(text: str) -> Any:
    """Read a push once, however often a test that waits asks for it."""
    return json.loads(text)


async def until(condition: Callable[[], object], patience: float = PATIENCE) -> None:
    """Wait, in real time, until the condition holds; sockets bring it about."""
    async with asyncio.timeout(patience):
        while not condition():  # noqa: ASYNC110
            await asyncio.sleep(0.002)


async def answered(client: Client, code: int, params: Any, forward: Forward, seconds: float = 20.0) -> Any:
    """Return the answer to a request that takes robot time."""
    asking = asyncio.ensure_future(client.ask(code, params))
    for _ in range(int(seconds / 0.1)):
        await settle()
        if asking.done():
            break
        await forward(seconds=0.1)
    return await asking


@dataclass(frozen=True)
class Pems:
    """Certificates of a client."""

    ca: bytes
    certificate: bytes
    key: bytes

    def channel(self, port: int, **changed: Any) -> grpc.aio.Channel:
        options = {"root_certificates": self.ca, "private_key": self.key, "certificate_chain": self.certificate}
        name, address = changed.pop("name", "cyberdog2.server"), changed.pop("address", ADDRESS)
        overrides = [("grpc.ssl_target_name_override", name)] if name else []
        credentials = grpc.ssl_channel_credentials(**{**options, **changed})
        return grpc.aio.secure_channel(
            f"{address}:{port}", credentials, options=[*overrides, ("grpc.use_local_subchannel_pool", 1)]
        )


class Stream:
    """One open request: what came so far, and whether it ended."""

    def __init__(self, client: Client, code: int, params: Any) -> None:
        self.answers: list[dict[str, Any]] = []
        self.call = client.open(code, params)
        self.reading = asyncio.ensure_future(self._read())

    async def _read(self) -> None:
        async for answer in self.call:
            self.answers.append(json.loads(answer.data))

    @property
    def ended(self) -> bool:
        return self.reading.done()

    @property
    def codes(self) -> list[int]:
        return [answer["feedback_code"] for answer in self.answers if "feedback_code" in answer]


async def localized(client: Client, passing: Callable[[Callable[[], object]], Awaitable[None]]) -> None:
    stream = Stream(client, 6004, {"type": 7})
    await passing(lambda: stream.ended)
    assert stream.answers[-1] == {"result": 0}


async def state(client: Client) -> int:
    return int((await client.ask(10001))["task_status"]["task_status"])


def examples(page: str) -> list[tuple[int, str, str]]:
    """Return the documentation's example of every code: its number, params, and what is said of the answer."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return [(int(code), params or "{}", answer.strip()) for code, params, answer in EXAMPLE.findall(text)]


def context_of(door: CyberDogDoor) -> Context:
    """Return what the chapters of an open door keep."""
    assert door._context is not None
    return door._context
