"""Passes connections between a CyberDog app and its robot, in both directions, and records their exchanges.

Both ends authenticate to the proxy, and it to them, as TLS allows no unnoticed proxy. Inside TLS every byte of HTTP/2
passes unchanged, so calls, deadlines, refusals and pings are those of the two ends.
"""

from __future__ import annotations

import logging
import ssl
import tempfile
from collections.abc import Callable
from functools import partial
from pathlib import Path

from google.protobuf.message import DecodeError, Message
from grpc import StatusCode

from roboglot.clients.cyberdog.link import Certificates
from roboglot.model.tap import Direction
from roboglot.recording.lines import Target, status_of
from roboglot.recording.proxy.calls import Call, both
from roboglot.recording.proxy.ends import End, Place, TcpProxy
from roboglot.recording.proxy.relay import ExchangeWriter
from roboglot.recording.proxy.sniffers import Note, Sniffer
from roboglot.transport.tls import server_context
from roboglot.values import dataclass
from roboglot.wire.cyberdog.channel import APP_NAME, APP_PORT, ROBOT_NAME
from roboglot.wire.cyberdog.chapters.system import HEARTBEAT, Beats
from roboglot.wire.cyberdog.proto import cyberdog_app_pb2 as pb

log = logging.getLogger(__name__)
NAMES: dict[int, str] = {code.value[0]: code.name for code in StatusCode}
SERVICE = "/grpcapi.GrpcApp/"
SEND, FETCH, BEAT = SERVICE + "sendMsg", SERVICE + "getFile", SERVICE + "heartbeat"


@dataclass(frozen=True, slots=True)
class Proof:
    """Certificate and key (PEM) of the proxy at one end, and the certificates that it trusts there."""

    certificate: bytes
    key: bytes
    believed: bytes


class DogRelay:
    """Listens at ``address`` in place of the robot, and on the app's port of this machine in place of the app.

    ``proof``: the proxy's proof towards the app; without it and ``certs`` in the robot's URL: no TLS. ``app`` of the
    URL: port on which the robot calls this machine (8981); the app is called at its own host, port ``called``.
    """

    def __init__(
        self, target: Target, address: str, writer: ExchangeWriter, proof: Proof | None, called: int = APP_PORT
    ) -> None:
        """Raises ValueError if the URL's certificates cannot be read."""
        self._target, self._address, self._writer, self._called = target, address, writer, called
        self._app_port = int(target.options.get("app", APP_PORT))
        own = _certificates(target)
        self._as_robot = _context(proof, server=True)
        self._to_app = _context(proof, server=False)
        self._as_app = _context(own, server=True)
        self._to_robot = _context(own, server=False)
        self._crossing = TcpProxy(writer.clock)
        self.watch = self._crossing.watch
        self._app_host = ""
        self._beats = Beats()

    async def open(self) -> None:
        """Listen at both ends. Raises OSError."""
        where = "127.0.0.1" if self._target.host.startswith("127.") else "0.0.0.0"
        for host, port, came, context in (
            (self._address, self._target.port, self._app_came, self._as_robot),
            (where, self._app_port, self._robot_came, self._as_app),
        ):
            await self._crossing.listen(host, port, came, context)

    async def close(self) -> None:
        """Hang up at both ends."""
        await self._crossing.close()

    def _app_came(self, app: End) -> None:
        """Dial the robot; calls of the robot go to the app that connected last."""
        host, port = app.peer
        self._app_host = host

        def note(direction: Direction, operation: str, payload: bytes, status: str, began: float | None) -> float:
            if direction is Direction.REQUEST:
                self._app_host = host
            return self._writer.note(f"{host}:{port}", direction, operation, payload, status, began)

        to = Place(self._target.host, self._target.port, self._to_robot, ROBOT_NAME)
        self._cross(app, to, AppSniffer(note))

    def _robot_came(self, robot: End) -> None:
        """Dial the app; without an app, drop the robot's connection."""
        if not self._app_host:
            robot.transport.abort()
            return
        to = Place(self._app_host, self._called, self._to_app, APP_NAME)
        self._cross(robot, to, RobotSniffer(partial(self._writer.note, f"{to.host}:{to.port}"), self._beats))

    def _cross(self, came: End, to: Place, sniffer: Sniffer) -> None:
        made = End(self.watch)
        came.look, made.look = sniffer.from_client, sniffer.from_robot
        self._crossing.cross(came, to, made)


class GrpcSniffer(Sniffer):
    """Calls of gRPC."""

    def __init__(self, note: Note) -> None:
        super().__init__(note)
        asking, answering = both(self.on_request, self.answered, self.ended)
        self._asking: Callable[[bytes], None] = asking.feed
        self._answering: Callable[[bytes], None] = answering.feed

    def from_client(self, data: bytes) -> None:
        self._asking(data)

    def from_robot(self, data: bytes) -> None:
        self._answering(data)

    def on_request(self, call: Call, message: bytes) -> None:
        """Handle a message of the caller."""

    def answered(self, call: Call, message: bytes) -> None:
        """Handle a message of the called side."""

    def ended(self, call: Call, status: int) -> None:
        """Handle the end of a call, with gRPC's status."""


class AppSniffer(GrpcSniffer):
    """Requests of an app, and the robot's answers."""

    def on_request(self, call: Call, message: bytes) -> None:
        call.code, text = _decoded(message) if call.path in (SEND, FETCH) else ("", message)
        call.at = self._note(Direction.REQUEST, call.code, text, "", None)

    def answered(self, call: Call, message: bytes) -> None:
        if call.path != SEND:
            self._note(Direction.REPLY, call.code, message, "ok", call.at)
            return
        read = _read(pb.RecResponse, message)
        answer = message if read is None else read.data.encode()
        self._note(Direction.REPLY, call.code, answer, status_of("cyberdog", answer), call.at)

    def ended(self, call: Call, status: int) -> None:
        if status and call.path in (SEND, FETCH):
            self._note(Direction.REPLY, call.code, b"", f"error {NAMES.get(status, status)}", call.at)


class RobotSniffer(GrpcSniffer):
    """Calls of the robot to its app: pushes, and heartbeats, recorded when they change."""

    def __init__(self, note: Note, beats: Beats) -> None:
        super().__init__(note)
        self._beats = beats

    def on_request(self, call: Call, message: bytes) -> None:
        if call.path != BEAT:
            code, text = _decoded(message)
            self._note(Direction.PUSH, code, text, "", None)
            return
        ticks = _read(pb.Ticks, message)
        if ticks is not None and (news := self._beats.news(ticks)):
            self._note(Direction.PUSH, HEARTBEAT, news.encode(), "", None)


def _read(kind: type[Message], data: bytes) -> Message | None:
    """Return the parsed message; None, with a warning, if the bytes cannot be parsed."""
    try:
        return kind.FromString(data)
    except DecodeError as error:
        log.warning("cannot parse a message: %s", error)
        return None


def _decoded(request: bytes) -> tuple[str, bytes]:
    """Return the code and the text of a message; "" and all its bytes if it cannot be parsed."""
    said = _read(pb.SendRequest, request)
    return ("", request) if said is None else (str(said.nameCode), said.params.encode())


def _certificates(target: Target) -> Proof | None:
    folder = target.options.get("certs", "none")
    try:
        if folder == "none":
            return None
        own = Certificates.load(Path(folder))
        return Proof(own.certificate, own.key, own.ca)
    except OSError as error:
        raise ValueError(f"the certificates in {folder} cannot be read: {error.strerror}") from None


def _context(proof: Proof | None, *, server: bool) -> ssl.SSLContext | None:
    """Return a context for mutual TLS; None without ``proof``. Raises ValueError for bad certificates."""
    if proof is None:
        return None
    with tempfile.TemporaryDirectory() as folder:  # ssl only reads files; this folder is private to the user
        names = Path(folder, "certificate.pem"), Path(folder, "key.pem")
        for name, data in zip(names, (proof.certificate, proof.key), strict=True):
            name.write_bytes(data)
        try:
            if server:
                context = server_context(*names)
            else:
                context = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)  # checks the other end's name and certificate
                context.load_cert_chain(*names)
            context.load_verify_locations(cadata=proof.believed.decode("ascii", "replace"))
        except ssl.SSLError as error:
            raise ValueError(f"the certificates cannot be used: {error.reason or error}") from None
    context.verify_mode = ssl.CERT_REQUIRED
    context.set_alpn_protocols(["h2"])
    return context
