"""The video and audio ports: packets to all connected clients while the stream is on (manual 3.2.17, 3.2.18, 6).

Clients that connect before ``stream on`` wait for it; later ones begin with a keyframe. Nothing is rendered or encoded
without a client.
"""

from __future__ import annotations

import asyncio
import logging
from typing import cast

from roboglot.media.audio import AudioStream
from roboglot.media.video import VideoStream
from roboglot.model.errors import RobotError
from roboglot.model.robot import Robot
from roboglot.protocols.robomaster.foreign_protocols import Greeting, turn_away_strangers
from roboglot.protocols.robomaster.keepalive import probe_for_life
from roboglot.protocols.robomaster.limits import MEDIA_BACKLOG_MAX, MEDIA_CONNECTIONS_MAX

log = logging.getLogger(__name__)


class MediaPort:
    """One stream of ``robot`` and its viewers. Each packet is one write: clients decode each read by itself."""

    def __init__(self, robot: Robot, stream: type[VideoStream] | type[AudioStream]) -> None:
        self._robot, self._stream = robot, stream
        self._watchers: set[_Watcher] = set()
        self.on = False

    def connect(self) -> asyncio.Protocol:
        """Return the protocol of a new connection."""
        return _Watcher(self)

    def switch(self, on: bool) -> None:
        """Start or stop the stream; idempotent. Raises ComponentMissing if the robot has no such stream."""
        if on:
            self._robot.require(self._stream)
        if on != self.on:
            self.on = on
            for watcher in tuple(self._watchers):
                watcher.follow()

    def close(self) -> None:
        """Disconnect all viewers."""
        self.on = False
        for watcher in tuple(self._watchers):
            watcher.transport.abort()

    def admit(self, watcher: _Watcher) -> bool:
        """Return whether another viewer is allowed."""
        if len(self._watchers) >= MEDIA_CONNECTIONS_MAX:
            return False
        self._watchers.add(watcher)
        return True

    def forget(self, watcher: _Watcher) -> None:
        """Remove a client that is gone."""
        self._watchers.discard(watcher)

    async def feed(self, watcher: _Watcher) -> None:
        """Send packets to one viewer until cancelled; a slow one skips to the next keyframe."""
        try:
            with self._robot[self._stream].subscribe() as packets:
                async for packet in packets:
                    await watcher.writable.wait()
                    watcher.transport.write(packet.data)
        except RobotError as error:
            log.warning("robomaster: refused a viewer: %s", error)


class _Watcher(asyncio.Protocol):
    transport: asyncio.Transport

    def __init__(self, port: MediaPort) -> None:
        self._port = port
        self._greeting = Greeting()
        self._task: asyncio.Task[None] | None = None
        self.writable = asyncio.Event()
        self.writable.set()

    def connection_made(self, transport: asyncio.BaseTransport) -> None:
        self.transport = transport = cast(asyncio.Transport, transport)  # uvloop's transport does not inherit from it
        if not self._port.admit(self):
            transport.abort()
            return
        transport.set_write_buffer_limits(high=MEDIA_BACKLOG_MAX)
        probe_for_life(transport)
        self.follow()

    def data_received(self, data: bytes) -> None:
        turn_away_strangers(self._greeting, self.transport, data)

    def connection_lost(self, _exc: Exception | None) -> None:
        self._port.forget(self)
        if self._task:
            self._task.cancel()

    def pause_writing(self) -> None:
        self.writable.clear()

    def resume_writing(self) -> None:
        self.writable.set()

    def follow(self) -> None:
        """Start or stop feeding, with the stream."""
        if self._task:
            self._task.cancel()
            self._task = None
        if self._port.on:
            self._task = asyncio.get_running_loop().create_task(self._port.feed(self), name="robomaster media")
