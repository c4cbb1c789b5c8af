"""Plays a recorded robot's file to all clients of the door: its topics as recorded, with pause, speed and seek.

It starts with the first client, so that viewers without playback controls see it too, and rewinds after the last one.
A thread reads, one job at a time: of many seeks at once only the last is executed. A chunk's messages wait in memory
for their time.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Coroutine, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial

from roboglot.model.background import beside
from roboglot.model.client_context import set_client
from roboglot.model.errors import NotReady
from roboglot.model.responder import Recorded
from roboglot.model.robot import Robot
from roboglot.protocols.foxglove.channels import Channel, Listener, PlaybackCommand
from roboglot.recording.message_index import MessageIndex, TimedMessage
from roboglot.recording.reader import BadRecording
from roboglot.recording.readings import BY_SCHEMA
from roboglot.wire.foxglove.messages import Playback, PlayStatus

log = logging.getLogger(__name__)
BEAT = 0.1  # s between two looks at the time
SELDOM = 10  # beats
NANO = 1e9
# Schemas whose last message before a moment gives the state at that moment.
STATES = frozenset(
    f"foxglove.{name}" for name in ("Grid", "SceneUpdate", "PoseInFrame", "FrameTransforms", "LaserScan")
) | {"roboglot.Battery", "roboglot.State", *BY_SCHEMA}


class Player:
    """Player of one file, on the clock's time: a faster or stopped clock plays faster or stops."""

    def __init__(self, robot: Robot, recorded: Recorded, index: MessageIndex) -> None:
        self._clock, self._index, self._recorded = robot.clock, index, recorded
        foreign = tuple(f"{start}/{other}/" for other in recorded.others for start in ("", "/truth"))
        self._channels: Mapping[int, Channel] = {  # by the topic's number in the index
            place: Channel(
                place + 1, topic.name, topic.encoding, topic.schema, topic.schema_encoding, topic.schema_data
            )
            for place, topic in enumerate(index.topics)
            if not topic.name.startswith(foreign)
        }
        self._listeners: list[Listener] = []
        self._newcomers: list[tuple[Listener, int, int]] = []  # with channel and subscription: they need the last one
        self._beating: asyncio.Task[None] | None = None
        self._playing: asyncio.Task[None] | None = None
        self._showing: asyncio.Task[None] | None = None
        self._reading: asyncio.Future[Sequence[TimedMessage]] | None = None
        self._broken = ""  # why the file can no longer be read
        self._rewind()

    # -- clients --

    @property
    def channels(self) -> Sequence[Channel]:
        """Topics of the file, without those of its other robots."""
        return tuple(self._channels.values())

    def join(self, listener: Listener) -> None:
        """Add a client; the first one starts the playback."""
        self._listeners.append(listener)
        listener.advertise(self.channels)
        if len(self._listeners) == 1:
            self._beating = self._begin(self._beat(), "foxglove time")
            self._go(PlayStatus.PLAYING)
        listener.played(self._state())

    def leave(self, listener: Listener) -> None:
        """Remove a client; after the last one, rewind."""
        if listener in self._listeners:
            self._listeners.remove(listener)
        if not self._listeners:
            self.close()

    def close(self) -> None:
        """Stop playing."""
        for task in (self._beating, self._playing, self._showing):
            if task is not None:
                task.cancel()
        self._beating = self._playing = self._showing = None
        self._newcomers.clear()
        self._rewind()

    def look_at_camera(self) -> None:
        """Do nothing: the recording has video or not."""

    def show_last(self, listener: Listener, channel: int, subscription: int) -> None:
        """Send a new subscriber the state at this moment of the recording, for topics that hold one."""
        self._newcomers.append((listener, channel, subscription))
        if self._showing is None or self._showing.done():
            self._showing = self._begin(self._show_newcomers(), "foxglove newcomers")

    # -- their requests --

    def control(self, listener: Listener, command: PlaybackCommand) -> None:
        """Play, pause or seek. Raises NotReady if the file has become unreadable."""
        if self._broken:
            raise NotReady(f"the recording cannot be read: {self._broken}")
        self._at = self._now()
        sought = command.seek is not None or (command.play and self._status is PlayStatus.ENDED)
        if sought:
            seek = self._recorded.first if command.seek is None else command.seek
            self._at = self._next = min(max(seek, self._recorded.first), self._recorded.last)
        self._speed, self._since = command.speed, self._clock.time()
        ended = self._status is PlayStatus.ENDED and not sought
        self._go(
            PlayStatus.PLAYING if command.play else PlayStatus.ENDED if ended else PlayStatus.PAUSED, sought=sought
        )
        state = replace(self._state(), sought=sought)
        for other in tuple(self._listeners):
            other.played(replace(state, request=command.request) if other is listener else state)

    # -- playing --

    def _rewind(self) -> None:
        self._status, self._speed, self._broken = PlayStatus.PAUSED, 1.0, ""
        self._at = self._next = self._recorded.first  # position at ``_since``; the next message to send
        self._since = self._clock.time()

    def _now(self) -> int:
        """Return the current position in the recording, ns since 1970."""
        if self._status is not PlayStatus.PLAYING:
            return self._at
        return min(self._at + round((self._clock.time() - self._since) * self._speed * NANO), self._recorded.last)

    def _state(self) -> Playback:
        return Playback(self._status, self._now(), self._speed)

    def _go(self, status: PlayStatus, *, sought: bool = False) -> None:
        """Continue from the current position, or stay there."""
        if self._playing is not None:
            self._playing.cancel()
        self._status, self._since = status, self._clock.time()
        self._playing = self._begin(self._play(sought=sought), "foxglove playback")

    def _begin(self, work: Coroutine[None, None, None], name: str) -> asyncio.Task[None]:
        return asyncio.get_running_loop().create_task(work, name=name)

    async def _play(self, *, sought: bool) -> None:
        set_client("")  # not on behalf of the client that started it
        try:
            if sought:
                await self._show(self._at)
            if self._status is PlayStatus.PLAYING:
                await self._play_on(self._index.play(self._next))
        except (OSError, BadRecording) as error:
            log.warning("playback of %s ends: %s", self._recorded.path, error)
            self._broken = str(error)
        if self._status is PlayStatus.PLAYING:
            self._at, self._status = self._now() if self._broken else self._recorded.last, PlayStatus.ENDED
            for listener in tuple(self._listeners):
                listener.played(self._state())

    async def _play_on(self, batches: Iterator[Sequence[TimedMessage]]) -> None:
        while batch := await self._read(batches):
            for message in batch:
                due = self._since + (message.at - self._at) / NANO / self._speed
                if due > self._clock.time():
                    await self._clock.sleep_until(due)
                self._deliver(message)
                self._next = message.at + 1

    async def _read(self, batches: Iterator[Sequence[TimedMessage]]) -> Sequence[TimedMessage]:
        """Return the next messages; none at the end."""
        return await self._beside(partial(next, batches, ()))

    async def _beside(self, read: Callable[[], Sequence[TimedMessage]]) -> Sequence[TimedMessage]:
        """Read in a thread after the previous job has ended, which continues even if no longer awaited."""
        with self._clock.holding():
            while self._reading is not None and not self._reading.done():
                await asyncio.wait([self._reading])
            reading = self._reading = asyncio.ensure_future(beside(read))
            reading.add_done_callback(lambda ended: ended.cancelled() or ended.exception())
            return await asyncio.shield(reading)

    async def _beat(self) -> None:
        number = 0
        async for _ in self._clock.every(BEAT):
            number += 1
            for listener in tuple(self._listeners):
                listener.beat(self._now(), seldom=number % SELDOM == 0)

    def _deliver(self, message: TimedMessage) -> None:
        if (channel := self._channels.get(message.topic)) is not None:
            for listener in tuple(self._listeners):
                if (subscription := listener.wants(channel.id)) is not None:
                    listener.deliver(subscription, message.at, message.data)

    # -- the state at a moment --

    async def _show(self, at: int) -> None:
        """Send all clients the state just before a moment."""
        wanted = {
            place
            for place, channel in self._channels.items()
            if channel.schema in STATES and any(one.wants(channel.id) is not None for one in self._listeners)
        }
        for message in await self._last(at - 1, wanted):
            self._deliver(message)

    async def _show_newcomers(self) -> None:
        set_client("")
        while self._newcomers:
            newcomers, self._newcomers = self._newcomers, []
            wanted = {number - 1 for _, number, _ in newcomers if self._channels[number - 1].schema in STATES}
            try:
                found = {message.topic: message for message in await self._last(self._next - 1, wanted)}
            except (OSError, BadRecording) as error:
                log.warning("cannot show %s to a new subscriber: %s", self._recorded.path, error)
                return
            for listener, number, subscription in newcomers:
                if (message := found.get(number - 1)) is not None and listener.wants(number) == subscription:
                    listener.deliver(subscription, message.at, message.data)

    async def _last(self, at: int, places: set[int]) -> Sequence[TimedMessage]:
        if not places:
            return ()
        return await self._beside(partial(self._index.last, at, places))


async def open_source(robot: Robot) -> Player:
    """Return the source of a robot that is played back. Raises BadRecording, OSError."""
    assert robot.responder is not None
    recorded = robot.responder.recorded
    assert recorded is not None
    return Player(robot, recorded, await beside(partial(MessageIndex, recorded.path)))
