"""Passes calls between a CyberDog app and its robot, in both directions, and notes what they mean.

Both ends prove themselves to the proxy, and it to them: TLS lets nothing stand between them unnoticed. The messages
themselves pass as the bytes that they came as.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator, Callable
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

import grpc
from google.protobuf.message import DecodeError, Message

from roboglot.clients.cyberdog.link import Certificates
from roboglot.model.tap import Direction
from roboglot.recording.lines import Target, status_of
from roboglot.recording.proxy.relay import Book
from roboglot.wire.cyberdog.channel import APP_NAME, APP_PORT, ROBOT_NAME, client_options, server_options
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT, Beats
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

log = logging.getLogger(__name__)
SERVICE = "grpcapi.GrpcApp"
CALLS_MAX = 512


@dataclass(frozen=True, slots=True)
class Proof:
    """Certificate and key (PEM) of the proxy as the robot, and whose certificates it believes as apps'."""

    certificate: bytes
    key: bytes
    callers: bytes


@dataclass(slots=True)
class _Asked:
    """A request: when it came, and its code once that has been read."""

    at: float
    code: str = ""


class DogRelay:
    """Listens at ``address`` as the robot does, and on ``app_port`` of this machine as the app does.

    ``proof`` None, and no ``certs`` in the robot's URL: without TLS. ``app`` of the URL is the port where the robot
    calls this machine (8981); the app is called at its own host, port ``called``.
    """

    def __init__(self, target: Target, address: str, book: Book, proof: Proof | None, called: int = APP_PORT) -> None:
        """Raises ValueError where the URL's certificates cannot be read."""
        self._target, self._address, self._book, self._proof, self._called = target, address, book, proof, called
        self._app_port = int(target.options.get("app", APP_PORT))
        self._own = _certificates(target)
        self._servers: list[grpc.aio.Server] = []
        self._robot: grpc.aio.Channel | None = None
        self._apps: dict[str, grpc.aio.Channel] = {}
        self._app_host = ""
        self._beats = Beats()

    async def open(self) -> None:
        """Listen at both ends. Raises OSError."""
        self._robot = self._channel(f"{self._target.host}:{self._target.port}", ROBOT_NAME, self._to_robot())
        asked = {"sendMsg": self._pass(self._ask, stream=True), "getFile": self._pass(self._fetch, stream=True)}
        pushed = {"sendMsg": self._pass(self._push, stream=True), "heartbeat": self._pass(self._beat, stream=False)}
        own = self._own
        as_app = own and grpc.ssl_server_credentials([(own.key, own.certificate)], own.ca, require_client_auth=True)
        proof = self._proof
        as_robot = proof and grpc.ssl_server_credentials(
            [(proof.key, proof.certificate)], proof.callers, require_client_auth=True
        )
        await self._serve(f"{self._address}:{self._target.port}", asked, as_robot)
        where = "127.0.0.1" if self._target.host.startswith("127.") else "0.0.0.0"
        await self._serve(f"{where}:{self._app_port}", pushed, as_app)

    async def close(self) -> None:
        """Hang up at both ends."""
        await asyncio.gather(*(server.stop(None) for server in self._servers))
        for channel in (self._robot, *self._apps.values()):
            if channel is not None:
                await channel.close()

    async def _serve(
        self, where: str, methods: dict[str, grpc.RpcMethodHandler], credentials: grpc.ServerCredentials | None
    ) -> None:
        server = grpc.aio.server(options=server_options(), maximum_concurrent_rpcs=CALLS_MAX)
        server.add_generic_rpc_handlers((grpc.method_handlers_generic_handler(SERVICE, methods),))
        try:
            port = server.add_secure_port(where, credentials) if credentials else server.add_insecure_port(where)
        except RuntimeError:
            port = 0
        if not port:
            raise OSError(f"cannot listen on {where}: it is taken, or not an address of this machine")
        await server.start()
        self._servers.append(server)

    def _channel(self, where: str, name: str, credentials: grpc.ChannelCredentials | None) -> grpc.aio.Channel:
        options = client_options(name)
        if credentials is None:
            return grpc.aio.insecure_channel(where, options=options)
        return grpc.aio.secure_channel(where, credentials, options=options)

    def _to_robot(self) -> grpc.ChannelCredentials | None:
        own = self._own
        return own and grpc.ssl_channel_credentials(own.ca, own.key, own.certificate)

    def _app(self) -> grpc.aio.Channel | None:
        """The channel to the app that asked last."""
        if not self._app_host:
            return None
        if self._app_host not in self._apps:
            proof = self._proof
            credentials = proof and grpc.ssl_channel_credentials(proof.callers, proof.key, proof.certificate)
            self._apps[self._app_host] = self._channel(f"{self._app_host}:{self._called}", APP_NAME, credentials)
        return self._apps[self._app_host]

    def _pass(self, handler: Callable[..., object], *, stream: bool) -> grpc.RpcMethodHandler:
        """A method whose messages stay bytes."""
        return (grpc.unary_stream_rpc_method_handler if stream else grpc.unary_unary_rpc_method_handler)(handler)

    async def _ask(self, request: bytes, context: grpc.aio.ServicerContext) -> AsyncIterator[bytes]:
        """The app asks the robot."""
        self._app_host = _host(context.peer()) or self._app_host
        asked = self._note_request(context.peer(), request)
        async for message in self._called_through(self._robot, "sendMsg", request, context):
            self._soon(self._note_answer, context.peer(), asked, message)
            yield message

    async def _fetch(self, request: bytes, context: grpc.aio.ServicerContext) -> AsyncIterator[bytes]:
        """The app fetches a file."""
        asked = self._note_request(context.peer(), request)
        async for message in self._called_through(self._robot, "getFile", request, context):
            self._soon(self._note_chunk, context.peer(), asked, message)
            yield message

    async def _push(self, request: bytes, context: grpc.aio.ServicerContext) -> AsyncIterator[bytes]:
        """The robot tells the app something."""
        self._soon(self._note_push, f"{self._app_host}:{self._called}", request)
        async for message in self._called_through(self._app(), "sendMsg", request, context):
            yield message

    # -- noting: once what came is on its way --------------------------------------------------------------------------

    def _soon(self, note: Callable[..., object], *said: object) -> None:
        """Note it in the next round of the loop, with the time of now."""
        asyncio.get_running_loop().call_soon(note, self._book.clock.time(), *said)

    def _note_request(self, peer: str, request: bytes) -> _Asked:
        asked = _Asked(self._book.clock.time())

        def note() -> None:
            asked.code, text = _said(request)
            self._book.note(_name(peer), Direction.REQUEST, asked.code, text, "", None, asked.at)

        asyncio.get_running_loop().call_soon(note)
        return asked

    def _note_answer(self, now: float, peer: str, asked: _Asked, message: bytes) -> None:
        read = _read(pb.RecResponse, message)
        answer = message if read is None else read.data.encode()
        status = status_of("cyberdog", answer)
        self._book.note(_name(peer), Direction.REPLY, asked.code, answer, status, asked.at, now)

    def _note_chunk(self, now: float, peer: str, asked: _Asked, message: bytes) -> None:
        self._book.note(_name(peer), Direction.REPLY, asked.code, message, "ok", asked.at, now)

    def _note_push(self, now: float, to: str, request: bytes) -> None:
        code, text = _said(request)
        self._book.note(to, Direction.PUSH, code, text, "", None, now)

    async def _beat(self, request: bytes, context: grpc.aio.ServicerContext) -> bytes:
        """The robot's heartbeat; without an app no one takes it."""
        app = self._app()
        if app is None:
            await context.abort(grpc.StatusCode.UNAVAILABLE, "no app has come yet")
            raise AssertionError("abort raises")
        try:
            ticks = _read(pb.Ticks, request)
            if ticks is not None and (news := self._beats.news(ticks)):
                self._book.note(f"{self._app_host}:{self._called}", Direction.PUSH, HEARTBEAT, news.encode(), "", None)
            answer: bytes = await app.unary_unary(f"/{SERVICE}/heartbeat")(request, timeout=context.time_remaining())
        except grpc.aio.AioRpcError as error:
            await context.abort(error.code(), error.details() or "")
        return answer

    async def _called_through(
        self, channel: grpc.aio.Channel | None, method: str, request: bytes, context: grpc.aio.ServicerContext
    ) -> AsyncIterator[bytes]:
        """Call the other end, and pass its answers and its end as they are."""
        if channel is None:
            await context.abort(grpc.StatusCode.UNAVAILABLE, "no app has come yet")
            raise AssertionError("abort raises")
        call = channel.unary_stream(f"/{SERVICE}/{method}")(request, timeout=context.time_remaining())
        try:
            async for message in call:
                yield message
        except grpc.aio.AioRpcError as error:
            await context.abort(error.code(), error.details() or "")
        finally:
            call.cancel()


def _read(kind: type[Message], data: bytes) -> Message | None:
    """Return what the bytes mean; None where they are not understood: they pass all the same."""
    try:
        return kind.FromString(data)
    except DecodeError as error:
        log.warning("not understood: %s", error)
        return None


def _said(request: bytes) -> tuple[str, bytes]:
    """Return the code of a message, and its text; "" and all of it where it is not understood."""
    said = _read(pb.SendRequest, request)
    return ("", request) if said is None else (str(said.nameCode), said.params.encode())


def _certificates(target: Target) -> Certificates | None:
    folder = target.options.get("certs", "none")
    try:
        return None if folder == "none" else Certificates.load(Path(folder))
    except OSError as error:
        raise ValueError(f"the certificates in {folder} cannot be read: {error.strerror}") from None


def _name(peer: str) -> str:
    """gRPC's name of a peer ("ipv4:127.0.0.1:40312") as host:port."""
    return unquote(peer.partition(":")[2])


def _host(peer: str) -> str:
    return _name(peer).rpartition(":")[0]
