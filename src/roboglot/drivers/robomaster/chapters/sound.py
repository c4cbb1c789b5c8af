"""The microphone of an EP: its Opus is forwarded as it arrives and decoded for listeners; and applause."""

from __future__ import annotations

import contextlib
from collections.abc import AsyncIterator, Callable, Sequence
from typing import TYPE_CHECKING

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.media_feed import DecodedFeed, PacketFeed, Stream
from roboglot.drivers.supervisor import Supervisor
from roboglot.extras import lazy
from roboglot.media.audio import AudioStream
from roboglot.media.opus import AudioPacket
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.microphone import BLOCK, Microphone
from roboglot.model.errors import Refused, RobotError
from roboglot.model.feed import Feed, Viewer
from roboglot.model.perception import ClapsHeard, SpeechHeard
from roboglot.model.sound import SAMPLE_RATE, SoundBlock
from roboglot.wire.robomaster.telemetry import Applause

if TYPE_CHECKING:
    import numpy as np
    from av import AudioCodecContext
else:
    np = lazy("numpy")

QUEUE_MAX = 25  # packets: half a second
RUNS_MAX = 20  # runs of claps that a listener may lag behind

AudioFeed = PacketFeed[AudioPacket]


def audio_feed(clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> AudioFeed:
    """Return the sound packets of the robot; ``stamp`` is the time of arrival less their length."""

    async def packets() -> AsyncIterator[AudioPacket]:
        async for data in client.sounds():
            yield AudioPacket(clock.time() - BLOCK / SAMPLE_RATE, data)

    stream = Stream(client.audio.on, client.audio.off, packets)
    return PacketFeed("sound", supervisor, clock, stream, queue_max=QUEUE_MAX)


class RoboMasterMicrophone(Microphone):
    """Lost packets leave a gap."""

    def __init__(self, clock: Clock, client: RoboMasterClient, packet_feed: AudioFeed) -> None:
        self._client, self._packet_feed = client, packet_feed
        self._feed: Feed[SoundBlock] = DecodedFeed(packet_feed, clock, _decoder, _blocks, queue_max=QUEUE_MAX)

    async def probe(self) -> None:
        """Switch the stream. Raises RefusedByRobot if there is no microphone."""
        await (self._client.audio.on() if self._packet_feed.viewers else self._client.audio.off())

    def subscribe(self) -> Viewer[SoundBlock]:
        return self._feed.subscribe()


class RoboMasterAudio(AudioStream):
    """The robot's own packets, not encoded again."""

    def __init__(self, microphone: RoboMasterMicrophone, clock: Clock, packet_feed: AudioFeed) -> None:
        super().__init__(microphone, clock)
        self._packet_feed = packet_feed

    async def _encode(self) -> None:
        with self._packet_feed.subscribe() as packets:
            async for packet in packets:
                self._feed.push(packet)


class RoboMasterHearing(Hearing):
    """Applause as the robot counts it; it understands no speech."""

    def __init__(self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._clock, self._client, self._supervisor = clock, client, supervisor
        self._feed: Feed[ClapsHeard] = Feed(lambda: self._switch(True), lambda: self._switch(False), queue_max=RUNS_MAX)
        self._forget: Callable[[], None] = lambda: None

    async def probe(self) -> None:
        """Switch the reports. Raises RefusedByRobot if the robot has none."""
        await self._client.sound.event(self._feed.viewers > 0)
        self._forget()
        self._forget = self._client.listen(self._on_push, Applause)

    def claps(self) -> Viewer[ClapsHeard]:
        return self._feed.subscribe()

    def speech(self) -> Viewer[SpeechHeard]:
        raise Refused("an EP understands no speech")

    def _switch(self, on: bool) -> None:
        with contextlib.suppress(RobotError):  # without a link it is sent at the next connection
            self._supervisor.send("switching applause", self._client.sound.event(on))

    def _on_push(self, push: object) -> None:
        assert isinstance(push, Applause)
        self._feed.push(ClapsHeard(self._clock.time(), push.count))


def _decoder() -> AudioCodecContext:
    import av

    codec = av.AudioCodecContext.create("opus", "r")
    codec.sample_rate, codec.layout = SAMPLE_RATE, "mono"
    return codec


def _blocks(decoder: AudioCodecContext, packet: AudioPacket) -> Sequence[SoundBlock]:
    """Return blocks of BLOCK samples; none if the packet is not Opus."""
    from av import FFmpegError, Packet

    try:
        frames = decoder.decode(Packet(packet.data))
    except FFmpegError:
        return []
    blocks = []
    for frame in frames:
        decoded = frame.to_ndarray().reshape(-1)
        full = 1 if decoded.dtype == np.int16 else 32767  # decoders may return floats
        samples = np.clip(np.rint(decoded * full), -32768, 32767).astype(np.int16)
        for at in range(0, len(samples) - BLOCK + 1, BLOCK):
            piece = np.ascontiguousarray(samples[at : at + BLOCK])
            piece.setflags(write=False)
            blocks.append(SoundBlock(packet.stamp + at / SAMPLE_RATE, piece))
    return blocks
