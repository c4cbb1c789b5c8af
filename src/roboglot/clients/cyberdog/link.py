"""Both directions of the connection: calls to the robot, and the server for its calls. Knows no message by name.

A call on a dead connection fails at once; the connection is restored in the background, with growing pauses.
"""

from __future__ import annotations

import asyncio
import ipaddress
import re
from collections.abc import AsyncGenerator, Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NoReturn, Protocol

import grpc

from roboglot.clients.errors import BadAnswer, LinkLost, TimedOut
from roboglot.model.clock import Clock
from roboglot.model.tap import LOST, Line
from roboglot.text_files import open_bytes
from roboglot.transport.grpc_wakeups import prompt_wakeups
from roboglot.values import dataclass
from roboglot.wire.cyberdog.channel import APP_PORT, LOST_AFTER, ROBOT_NAME, ROBOT_PORT, SERVICE, client_options
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT, Beats
from roboglot.wire.cyberdog.messages import reading
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

REDIAL_MAX = 2000  # ms between two attempts to connect
PUSH_MAX = 5_242_880  # bytes per message
FOUND_PERIOD = 0.05  # s between two checks whether the robot has called
PEM_MAX = 1 << 20  # bytes
CALLERS_MAX = 64  # connections whose robot is remembered
IN_BAND = re.compile(r'"error_code"\s*:\s*([1-9]\d*)')

Reply = Callable[[str | bytes, str], None]


class Cancellable(Protocol):
    """A call that can be cancelled."""

    def cancel(self) -> bool:
        """Cancel it; return False if it has ended."""


@dataclass(frozen=True, slots=True)
class Certificates:
    """PEM texts: the common CA, and the app's certificate and key."""

    ca: bytes
    certificate: bytes
    key: bytes

    @classmethod
    def load(cls, folder: Path) -> Certificates:
        """Load ca-cert.pem, client-cert.pem and client-key.pem, written by ``roboglot certs``. Raises OSError."""
        return cls(*(_read_pem(folder / f"{name}.pem") for name in ("ca-cert", "client-cert", "client-key")))


def _read_pem(path: Path) -> bytes:
    with open_bytes(path) as file:
        return file.read(PEM_MAX)


@dataclass(frozen=True, slots=True)
class Heartbeat:
    """Status that the robot sends twice a second, with its own codes. ``at``: arrival, s on the client's clock."""

    at: float
    ip: str
    serial: str
    wifi_strength: int
    battery: int  # percent
    internet: bool
    motion_id: int
    task_status: int
    task_sub_status: int
    self_check: int
    self_check_description: str
    state: int
    wired_charging: bool
    wireless_charging: bool
    audio: bool


def _heartbeat(ticks: pb.Ticks, at: float) -> Heartbeat:
    return Heartbeat(
        at,
        ticks.ip,
        ticks.sn,
        ticks.wifi_strength,
        ticks.battery_power,
        ticks.internet,
        ticks.motion_status.motion_id,
        ticks.task_status.task_status,
        ticks.task_status.task_sub_status,
        ticks.self_check_status.code,
        ticks.self_check_status.description,
        ticks.state_switch_status.state,
        ticks.charging_status.wired_charging,
        ticks.charging_status.wireless_charging,
        ticks.audio,
    )


class DogLink:
    """Link to one robot. ``certificates`` None: no TLS. ``app_port`` None: no server, so no heartbeats and pushes."""

    def __init__(
        self,
        host: str,
        port: int,
        certificates: Certificates | None,
        clock: Clock,
        *,
        app_port: int | None,
        pushed: Callable[[int, str], None],
    ) -> None:
        self.clock = clock
        self.heartbeat: Heartbeat | None = None
        self.serial: str | None = None  # of the robot; calls of others are refused as soon as it is known
        self.app_port = app_port
        self.line: Line | None = None  # records requests, answers and pushes
        self._host, self._port, self._certificates, self._pushed = host, port, certificates, pushed
        self._channel: grpc.aio.Channel | None = None
        self._calls: _Calls | None = None
        self._server: grpc.aio.Server | None = None
        self._stopping: asyncio.Future[object] | None = None

    @property
    def connected(self) -> bool:
        """True while the robot's heartbeats arrive."""
        return self.heartbeat is not None and self.clock.time() - self.heartbeat.at < LOST_AFTER

    async def open(self) -> None:
        """Start the app's server; the first call dials the robot. Raises LinkLost if the port is taken."""
        name = f"[{self._host}]" if ":" in self._host else self._host
        options = [*client_options(ROBOT_NAME), ("grpc.max_reconnect_backoff_ms", REDIAL_MAX)]
        where, proof = f"{name}:{self._port}", self._certificates
        self.heartbeat, self.serial = None, None  # one from before the link was lost may be another robot's
        with prompt_wakeups():
            if proof:
                credentials = grpc.ssl_channel_credentials(proof.ca, proof.key, proof.certificate)
                self._channel = grpc.aio.secure_channel(where, credentials, options=options)
            else:
                self._channel = grpc.aio.insecure_channel(where, options=options)
        self._calls = _Calls(self._channel)
        if self.app_port is not None:
            await self._serve(self.app_port, self._channel)

    async def _serve(self, port: int, channel: grpc.aio.Channel) -> None:
        limits = [("grpc.so_reuseport", 0), ("grpc.max_receive_message_length", PUSH_MAX)]
        self._server = grpc.aio.server(options=[*limits, ("grpc.http2.min_ping_interval_without_data_ms", 500)])
        self._server.add_generic_rpc_handlers((_App(self).handlers,))
        where = f"{'127.0.0.1' if _on_this_machine(self._host) else '0.0.0.0'}:{port}"
        try:
            if self._certificates:
                proof = self._certificates
                pair = [(proof.key, proof.certificate)]
                secure = grpc.ssl_server_credentials(pair, proof.ca, require_client_auth=True)
                self.app_port = self._server.add_secure_port(where, secure)
            else:
                self.app_port = self._server.add_insecure_port(where)
        except RuntimeError as error:
            await channel.close()
            raise LinkLost(f"the robot cannot call back: {where} is in use, perhaps by another app") from error
        await self._server.start()

    async def close(self) -> None:
        """Hang up in both directions. May be cancelled, which does not stop it, and called again."""
        server, self._server = self._server, None
        if server:
            self._stopping = asyncio.ensure_future(server.stop(None))
        if self._stopping:
            await asyncio.shield(self._stopping)
        if self._channel:
            self._calls = None
            await self._channel.close()

    def _robot(self) -> _Calls:
        if self._calls is None:
            raise LinkLost("disconnected")
        return self._calls

    async def send(self, code: int, text: str) -> AsyncGenerator[tuple[int, str], None]:
        """Yield the answers to one request as (code, text) until the robot ends it. Raises LinkLost, BadAnswer."""
        call = self._robot().send(pb.SendRequest(nameCode=code, params=text))
        with self._exchange(call, code, text) as reply:
            async for answer in call:
                if answer is None:
                    raise BadAnswer(f"{code}: the robot's answer cannot be decoded")
                if reply is not None:
                    found = IN_BAND.search(answer.data)
                    reply(answer.data, f"error_code {found[1]}" if found else "")
                yield answer.nameCode, answer.data

    async def fetch(self, code: int, text: str) -> AsyncGenerator[pb.FileChunk, None]:
        """Yield the chunks of a file. Raises LinkLost, BadAnswer."""
        call = self._robot().fetch(pb.SendRequest(nameCode=code, params=text))
        with self._exchange(call, code, text) as reply:
            async for chunk in call:
                if chunk is None:
                    raise BadAnswer(f"{code}: a part of the robot's file cannot be decoded")
                if reply is not None:
                    reply(chunk.SerializeToString(), "")
                yield chunk

    @contextmanager
    def _exchange(self, call: Cancellable, code: int, text: str) -> Iterator[Reply | None]:
        """Yield the function that reports a reply, with its refusal, to the tap; None if nothing watches.

        Translates gRPC's errors, and cancels the call in the end.
        """
        line, key = self.line if self.line is not None and self.line.watched else None, str(int(code))
        began = 0.0 if line is None else line.request(key, text)

        def reply(data: str | bytes, refusal: str) -> None:
            assert line is not None
            line.reply(key, data, refusal or "ok", refusal, began)

        try:
            yield reply if line is not None else None
        except grpc.aio.AioRpcError as error:
            if line is not None:
                line.reply(key, b"", LOST, error.details() or error.code().name, began)
            raise _lost(error) from None
        finally:
            call.cancel()

    async def found(self, within: float, serial: str | None = None) -> Heartbeat:
        """Wait for a heartbeat of the robot (of any, without ``serial``) and return it; only its calls count then.

        Raises TimedOut after ``within`` s.
        """
        self.serial = serial
        deadline = self.clock.time() + within
        while self.heartbeat is None or not self.connected or self.is_stranger(self.heartbeat.serial):
            if self.clock.time() >= deadline:
                raise TimedOut(f"the robot did not call port {self.app_port} within {within:g} s")
            await self.clock.sleep(FOUND_PERIOD)
        self.serial = self.heartbeat.serial
        return self.heartbeat

    def is_stranger(self, serial: str | None) -> bool:
        """Return whether that is another robot, which had this app before and remembers its address."""
        return self.serial is not None and serial != self.serial


class _Calls:
    """The robot's calls over one channel; bytes that are not an answer become None."""

    def __init__(self, channel: grpc.aio.Channel) -> None:
        written = pb.SendRequest.SerializeToString
        answer, chunk = reading(pb.RecResponse.FromString), reading(pb.FileChunk.FromString)
        self.send = channel.unary_stream(f"/{SERVICE}/sendMsg", written, answer)
        self.fetch = channel.unary_stream(f"/{SERVICE}/getFile", written, chunk)


class _App:
    """The service of the app, which the robot calls."""

    def __init__(self, link: DogLink) -> None:
        self._link, self._beats = link, Beats()
        self._callers = dict[str, str]()  # serial number by connection, that of the last heartbeat at the end
        ticks, pushed = reading(pb.Ticks.FromString), reading(pb.SendRequest.FromString)
        self.handlers = grpc.method_handlers_generic_handler(
            SERVICE,
            {
                "heartbeat": grpc.unary_unary_rpc_method_handler(self._beat, ticks, pb.Result.SerializeToString),
                "sendMsg": grpc.unary_stream_rpc_method_handler(self._push, pushed, pb.RecResponse.SerializeToString),
            },
        )

    async def _beat(self, request: pb.Ticks | None, rpc: grpc.aio.ServicerContext) -> pb.Result:
        if request is None:
            await _refuse(rpc)
        self._callers.pop(rpc.peer(), None)
        self._callers[rpc.peer()] = request.sn
        if len(self._callers) > CALLERS_MAX:
            del self._callers[next(iter(self._callers))]
        await self._admit(rpc)
        self._link.heartbeat = _heartbeat(request, self._link.clock.time())
        if self._link.line is None or not self._link.line.watched:
            self._beats.forget()
        elif news := self._beats.news(request):
            self._link.line.push(HEARTBEAT, news)
        return pb.Result(result="ok")

    async def _push(
        self, request: pb.SendRequest | None, rpc: grpc.aio.ServicerContext
    ) -> AsyncGenerator[pb.RecResponse, None]:
        if request is None:
            await _refuse(rpc)
        await self._admit(rpc)
        if self._link.line is not None and self._link.line.watched:
            self._link.line.push(str(int(request.nameCode)), request.params)
        self._link._pushed(request.nameCode, request.params)
        yield pb.RecResponse(nameCode=request.nameCode, data="{}")

    async def _admit(self, rpc: grpc.aio.ServicerContext) -> None:
        """End a call of another robot, or of one that has not named itself by a heartbeat. Raises what gRPC does."""
        if self._link.is_stranger(self._callers.get(rpc.peer())):
            await rpc.abort(grpc.StatusCode.PERMISSION_DENIED, "this app is connected to another robot")


async def _refuse(rpc: grpc.aio.ServicerContext) -> NoReturn:
    """End a call of bytes that are not a message. Raises what gRPC does."""
    await rpc.abort(grpc.StatusCode.INTERNAL, "the message cannot be decoded")
    raise AssertionError


def _lost(error: grpc.aio.AioRpcError) -> LinkLost:
    kind = TimedOut if error.code() is grpc.StatusCode.DEADLINE_EXCEEDED else LinkLost
    lost = kind(f"{error.code().name.lower()}: {error.details()}")
    lost.status = f"error {error.code().name}"
    return lost


def _on_this_machine(host: str) -> bool:
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host == "localhost"


__all__ = ["APP_PORT", "ROBOT_PORT", "Certificates", "DogLink", "Heartbeat"]
