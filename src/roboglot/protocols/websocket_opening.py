"""Opening handshake of a WebSocket: reads, checks and answers the client's request."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping
from contextvars import copy_context
from http import HTTPStatus
from typing import TYPE_CHECKING

from roboglot.model.admission import NO_PROOF, Admission, Forbidden, Proof, ProofKind, Unknown
from roboglot.model.client_context import set_client
from roboglot.protocols.browsers import Browsers, of_rows
from roboglot.protocols.channels import Channel
from roboglot.protocols.forwarding import caller
from roboglot.protocols.websocket_writer import Writer
from roboglot.values import dataclass

if TYPE_CHECKING:
    from websockets.http11 import Request
    from websockets.server import ServerProtocol

log = logging.getLogger(__name__)

OPENING_MAX = 8192  # bytes of a request
PATH_SHOWN_MAX = 80  # characters of a path in a refusal
MESSAGE_MAX = 8 * 1024 * 1024  # bytes of a message, whole or fragmented
OPENING_SECONDS_MAX = 10.0
HEAD_END = b"\r\n\r\n"


@dataclass(frozen=True, slots=True)
class Entrance:
    """Entrance of a door: its channels by their paths, and the access control for its clients."""

    door: str
    channels: Mapping[str, Channel]
    browsers: Browsers
    admission: Admission


@dataclass(frozen=True, slots=True)
class Opened:
    """An admitted client; ``early``: bytes received after its request. ``identity`` is empty without access control."""

    channel: Channel
    protocol: ServerProtocol
    identity: str
    early: bytes


class Opening:
    """Handles received bytes until it calls ``opened``; disconnects a client that is too slow.

    ``wait_for`` awaits in the background and pauses reading meanwhile.
    """

    def __init__(
        self,
        entrance: Entrance,
        writer: Writer,
        wait_for: Callable[[Awaitable[None]], None],
        opened: Callable[[Opened], None],
    ) -> None:
        self._entrance, self._writer, self._wait_for, self._opened = entrance, writer, wait_for, opened
        self._host = self._name = ""
        self._head = bytearray()
        self._early = b""  # received after the request, before the connection was accepted
        self._protocol: ServerProtocol | None = None  # set once the request is complete
        self._timer = asyncio.get_running_loop().call_later(OPENING_SECONDS_MAX, writer.abort)

    def begin(self, host: str, name: str) -> None:
        """Expect the request of the client at ``host``; ``name`` includes its port."""
        self._host, self._name = host, name

    def close(self) -> None:
        """Stop: the client is gone, or refused."""
        self._timer.cancel()

    def receive(self, data: bytes) -> None:
        """Answer the request once it is complete."""
        from websockets.http11 import Request
        from websockets.server import ServerProtocol

        if self._protocol is not None:
            self._early += data
            return
        self._head += data
        head, end, rest = bytes(self._head).partition(HEAD_END)
        if not end and len(self._head) <= OPENING_MAX:
            return
        self._protocol = protocol = ServerProtocol(max_size=MESSAGE_MAX)
        if not end:
            self._refuse(protocol, HTTPStatus.REQUEST_HEADER_FIELDS_TOO_LARGE, "the request is too long")
            return
        self._timer.cancel()
        self._early = rest
        protocol.receive_data(head + end)
        requests = protocol.events_received()
        if requests and isinstance(requests[0], Request):
            self._check(protocol, requests[0])
        else:  # not HTTP
            self._writer.close()

    def _check(self, protocol: ServerProtocol, request: Request) -> None:
        from websockets.typing import Subprotocol

        entrance, path = self._entrance, request.path.partition("?")[0]
        channel = entrance.channels.get(path)
        if channel is None:
            self._refuse(protocol, HTTPStatus.NOT_FOUND, _elsewhere(path, list(entrance.channels)))
            return
        protocol.available_subprotocols = [Subprotocol(name) for name in channel.subprotocols] or None
        response = protocol.accept(request)
        rows = [(name.lower().encode(), value.encode()) for name, value in request.headers.raw_items()]
        if response.status_code != HTTPStatus.SWITCHING_PROTOCOLS:
            protocol.send_response(response)
            self._writer.flush(protocol)
        elif refusal := entrance.browsers.refusal(of_rows(rows, "GET")):
            self._refuse(protocol, HTTPStatus.FORBIDDEN, refusal)
        elif not entrance.admission.enforced:
            self._accept(protocol, request, channel)
        else:
            self._name = caller(self._name, rows)
            self._authenticate(protocol, request, channel, dict(rows).get(b"authorization", b"").decode())

    def _authenticate(self, protocol: ServerProtocol, request: Request, channel: Channel, authorization: str) -> None:
        """Identify the client, in the background if that takes time."""
        proof = Proof(ProofKind.HTTP, authorization) if authorization else NO_PROOF
        who = self._entrance.admission.cached_identity(self._name, proof)
        if who is not None:
            self._authorize(protocol, request, channel, who)
        else:
            self._wait_for(self._admit(protocol, request, channel, proof))

    async def _admit(self, protocol: ServerProtocol, request: Request, channel: Channel, proof: Proof) -> None:
        try:
            who = await self._entrance.admission.admit(self._name, proof)
        except Unknown as unknown:
            ask = {"WWW-Authenticate": 'Basic realm="roboglot"'}
            self._refuse(protocol, HTTPStatus.UNAUTHORIZED, str(unknown), ask)
        else:
            self._authorize(protocol, request, channel, who)

    def _authorize(self, protocol: ServerProtocol, request: Request, channel: Channel, who: str) -> None:
        path = request.path.partition("?")[0]
        try:
            copy_context().run(self._check_right, f"open {path}", channel, who)
        except Forbidden as forbidden:
            self._refuse(protocol, HTTPStatus.FORBIDDEN, str(forbidden))
        else:
            self._accept(protocol, request, channel, who)

    def _check_right(self, operation: str, channel: Channel, who: str) -> None:
        """Raise Forbidden if the client may not open the channel."""
        door = self._entrance.door
        set_client(f"{door} {who or self._host}", self._name, who)
        self._entrance.admission.check(door, operation, channel.right)

    def _accept(self, protocol: ServerProtocol, request: Request, channel: Channel, who: str = "") -> None:
        if self._writer.lost:
            return
        protocol.send_response(protocol.accept(request))
        self._writer.flush(protocol)
        log.info("%s: %s connected", self._entrance.door, who or self._host)
        self._opened(Opened(channel, protocol, who, self._early))

    def _refuse(
        self, protocol: ServerProtocol, status: HTTPStatus, reason: str, headers: Mapping[str, str] | None = None
    ) -> None:
        log.info("%s: refused %s: %s", self._entrance.door, self._host, reason)
        response = protocol.reject(status, f"{reason}\n")
        response.headers.update(headers or {})
        protocol.send_response(response)
        self._writer.flush(protocol)


def _elsewhere(path: str, known: list[str]) -> str:
    """Return where this port has its WebSockets; a path of a stranger is repeated in part only."""
    *others, last = known
    places = f"{', '.join(others)} and {last}" if others else last
    return f"there is nothing at {path[:PATH_SHOWN_MAX]!r}: this port has WebSockets at {places}"
