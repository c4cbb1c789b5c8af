"""Messages of fleet control that wait for their turn. While many wait, the broker keeps the others."""

from __future__ import annotations

import asyncio
import json
import socket
from collections import deque
from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol, cast

if TYPE_CHECKING:
    import aiomqtt

WAITING_MAX = 32  # messages; beyond this, no more are read until half are answered
STOPS = frozenset({"cancelOrder", "startPause"})


class Paho(Protocol):
    """Client below aiomqtt's, as far as it is used."""

    def socket(self) -> socket.socket | None:
        """Return the socket of the connection."""

    def loop_read(self) -> object:
        """Read a message."""


class Intake(asyncio.Queue["aiomqtt.Message"]):
    """The queue of an aiomqtt client. ``waiting``: what is in it."""

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
        intake._paho, intake._look = cast(Paho, parts["_client"]), look
        intake._disconnected = cast("asyncio.Future[None]", parts["_disconnected"])
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
        """Read as aiomqtt does."""
        assert self._paho is not None
        try:
            while self._paused < 0:
                self._paho.loop_read()
                pending = getattr(self._paho.socket(), "pending", None)
                if pending is None or not pending():
                    break
        except Exception as error:  # noqa: BLE001 - it is raised where messages are awaited
            if not self._disconnected.done():
                self._disconnected.set_exception(error)


def stops(message: aiomqtt.Message) -> bool:
    """Return whether a message cancels the order or pauses the robot."""
    if not isinstance(message.payload, bytes | bytearray) or not str(message.topic).endswith("/instantActions"):
        return False
    try:
        actions = json.loads(message.payload)["actions"]
        return any(action["actionType"] in STOPS for action in actions)
    except (ValueError, TypeError, KeyError, RecursionError):
        return False
