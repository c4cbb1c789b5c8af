"""Topics of one robot for all clients: those of a recording, sampled while there are clients.

Values are encoded only for subscribed topics, once for all clients.
"""

from __future__ import annotations

import asyncio

from roboglot.media.video import VideoStream
from roboglot.model.errors import NotFound
from roboglot.model.robot import Robot
from roboglot.protocols.foxglove.channels import Channel, Listener, PlaybackCommand
from roboglot.recording.entries import KINDS, Entry, encoded
from roboglot.recording.readings import READINGS
from roboglot.recording.redaction import Redaction
from roboglot.recording.sampler import POSE_PERIOD, STATE_BEATS, Sampler, Stamps
from roboglot.values import dataclass

CHANNELS_MAX = 200
CAMERA = "camera"
# Kinds of recorded values whose last one is sent to new clients.
KEPT = frozenset({"battery", "state", "grid", "scene", "pose", "transforms", "scan", *(r.topic for r in READINGS)})


@dataclass(frozen=True, slots=True)
class LiveChannel(Channel):
    """A topic of the robot, and the kind of its values."""

    kind: str


def _channel(number: int, topic: str, kind: str) -> LiveChannel:
    written = KINDS[kind]
    protobuf = written.is_protobuf
    encoding, schema_encoding = ("protobuf", "protobuf") if protobuf else ("json", "jsonschema")
    return LiveChannel(number, topic, encoding, written.schema, schema_encoding, written.schema_data, kind)


class Topics:
    """Samples the robot while there are listeners."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._redaction = Redaction()
        self._stamps = Stamps(robot)
        self._channels: dict[tuple[str, str], LiveChannel] = {}
        self._last: dict[int, Entry] = {}
        self._listeners: list[Listener] = []
        self._sampler: Sampler | None = None
        self._task: asyncio.Task[None] | None = None

    @property
    def channels(self) -> list[LiveChannel]:
        """Known channels."""
        return list(self._channels.values())

    def join(self, listener: Listener) -> None:
        """Add a client: it gets all known topics, and further ones."""
        if self._sampler is None:
            self._sampler = Sampler(self._robot, self._put)
            self._announce_camera()
            self._sampler.beat(0)
            self._task = asyncio.get_running_loop().create_task(self._sample(), name="foxglove topics")
        self._listeners.append(listener)
        listener.advertise(self.channels)

    def leave(self, listener: Listener) -> None:
        """Remove a client; after the last one, sampling ends."""
        if listener in self._listeners:
            self._listeners.remove(listener)
        self.look_at_camera()
        if not self._listeners:
            self.close()

    def close(self) -> None:
        """Stop sampling."""
        if self._sampler is not None:
            self._sampler.close()
            self._sampler = None
        if self._task is not None:
            self._task.cancel()
            self._task = None
        self._last.clear()

    def show_last(self, listener: Listener, channel: int, subscription: int) -> None:
        """Send a new subscriber the last message, so that it need not wait for a change."""
        if (entry := self._last.get(channel)) is not None:
            listener.deliver(subscription, entry.at, encoded(entry, self._redaction))

    def look_at_camera(self) -> None:
        """Film only while a client has subscribed to the camera."""
        if self._sampler is not None:
            camera = next((channel.id for channel in self.channels if channel.kind == "video"), -1)
            self._sampler.film(any(listener.wants(camera) is not None for listener in self._listeners))

    def control(self, _listener: Listener, _command: PlaybackCommand) -> None:
        """Raise NotFound: a live robot has no playback."""
        raise NotFound("this robot is live; one of a recording (--robot a=recording:FILE) can be played back")

    async def _sample(self) -> None:
        number = 0
        async for _ in self._robot.clock.every(POSE_PERIOD):
            number += 1
            if self._sampler is not None:
                self._sampler.beat(number)
            self._announce_camera()
            at, _wall = self._stamps.now()
            for listener in tuple(self._listeners):
                listener.beat(at, seldom=number % STATE_BEATS == 0)

    def _put(self, entry: Entry) -> None:
        channel = self._channel(entry.topic, entry.kind)
        if channel is None:
            return
        if entry.kind in KEPT:
            self._last[channel.id] = entry
        data: bytes | None = None
        for listener in tuple(self._listeners):
            if (subscription := listener.wants(channel.id)) is not None:
                if data is None:
                    data = encoded(entry, self._redaction)
                listener.deliver(subscription, entry.at, data)

    def _announce_camera(self) -> None:
        if VideoStream in self._robot:  # a real robot's appears with its link
            self._channel(f"/{self._robot.id}/{CAMERA}", "video")

    def _channel(self, topic: str, kind: str) -> LiveChannel | None:
        known = self._channels.get((topic, kind))
        if known is None and len(self._channels) < CHANNELS_MAX:
            known = self._channels[topic, kind] = _channel(len(self._channels) + 1, topic, kind)
            for listener in self._listeners:
                listener.advertise([known])
        return known


async def open_source(robot: Robot) -> Topics:
    """Return the live source of a robot."""
    return Topics(robot)
