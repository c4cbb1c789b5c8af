"""Queue of fleet control's messages. While it is long, the broker keeps further ones.

Of a longer message than is read, only the beginning is kept. Bytes that are no MQTT end the connection: paho would take
them up again at every look, and aiomqtt would leave the socket open.
"""

from __future__ import annotations

import asyncio
import socket
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, cast

from roboglot.wire.vda5050.orders import MESSAGE_MAX, InstantActions, Malformed, read

if TYPE_CHECKING:
    import aiomqtt

PACKET_MAX = MESSAGE_MAX + 65540  # bytes: a message too long by one, behind the longest topic
PIECE_MAX = 65536  # bytes that are read at once
WAITING_MAX = 32  # messages; beyond this, no more are read until half are answered
STOPS = frozenset({"cancelOrder", "startPause"})


class Paho(Protocol):
    """Client below aiomqtt's, as far as it is used."""

    _in_packet: dict[str, object]
    _in_messages: dict[int, object]
    _sock_recv: Callable[[int], bytes]

    def socket(self) -> socket.socket | None:
        """Return the socket of the connection."""

    def loop_read(self) -> object:
        """Read a message."""

    def _sock_close(self) -> None:
        """Close the connection."""


class _Beginning(bytearray):
    """The packet that is read, without what goes beyond PACKET_MAX."""

    def __iadd__(self, more: bytes) -> _Beginning:  # type: ignore[misc, override]
        self.extend(more[: max(0, PACKET_MAX - len(self))])
        return self


class Intake(asyncio.Queue["aiomqtt.Message"]):
    """Queue of an aiomqtt client. ``waiting``: its messages."""

    _look: Callable[[], None]
    _disconnected: asyncio.Future[None]

    def __init__(self, maxsize: int = 0) -> None:
        self.waiting = deque["aiomqtt.Message"]()
        super().__init__(maxsize)
        self._paho: Paho | None = None
        self._paused = -1  # file descriptor that is not read

    @staticmethod
    def of(client: aiomqtt.Client, look: Callable[[], None]) -> Intake:
        """Return the queue of a client that has connected; it calls ``look`` with every message from now on."""
        parts = vars(client)
        intake = cast(Intake, parts["_queue"])
        intake._paho = paho = cast(Paho, parts["_client"])
        intake._look = look
        intake._disconnected = cast("asyncio.Future[None]", parts["_disconnected"])
        receive = paho._sock_recv

        def receive_piece(size: int) -> bytes:
            if size > PACKET_MAX and not isinstance(paho._in_packet["packet"], _Beginning):
                paho._in_packet["packet"] = _Beginning()
            return receive(min(size, PIECE_MAX))

        paho._sock_recv = receive_piece
        if (open := paho.socket()) is not None:
            asyncio.get_running_loop().add_reader(open.fileno(), intake._read)
        return intake

    def _put(self, item: aiomqtt.Message) -> None:
        super()._put(item)
        self.waiting.append(item)
        if self._paho is None:
            return
        self._look()
        if len(self.waiting) >= WAITING_MAX and self._paused < 0 and (open := self._paho.socket()):
            self._paused = open.fileno()
            asyncio.get_running_loop().remove_reader(self._paused)

    def _get(self) -> aiomqtt.Message:
        item = super()._get()
        self.waiting.popleft()
        if self._paused >= 0 and len(self.waiting) <= WAITING_MAX // 2:
            asyncio.get_running_loop().call_soon(self._resume)
        return item

    def _resume(self) -> None:
        """Read again, unless the connection ended meanwhile."""
        paused, self._paused = self._paused, -1
        if paused >= 0 and self._paho and (open := self._paho.socket()) is not None and open.fileno() == paused:
            asyncio.get_running_loop().add_reader(paused, self._read)
            self._read()  # TLS may have more in a buffer of its own

    def _read(self) -> None:
        """Read in place of aiomqtt."""
        assert self._paho is not None
        try:
            while self._paused < 0:
                self._paho.loop_read()
                if self._paho._in_messages:
                    raise ValueError("the broker sends messages with a QoS that was not requested")
                pending = getattr(self._paho.socket(), "pending", None)
                if pending is None or not pending():
                    break
        except Exception as error:  # noqa: BLE001 - it is raised where messages are awaited
            if not self._disconnected.done():
                self._disconnected.set_exception(error)
            self._paho._sock_close()


def stops(message: aiomqtt.Message) -> bool:
    """Return whether a message cancels the order or pauses the robot."""
    if not isinstance(message.payload, bytes | bytearray) or not str(message.topic).endswith("/instantActions"):
        return False
    try:
        return any(action.action_type in STOPS for action in read(bytes(message.payload), InstantActions).actions)
    except Malformed:
        return False
