"""The camera of an EP: its H.264 is forwarded as it arrives, and decoded for viewers of pictures.

The robot films only while either has viewers.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from typing import TYPE_CHECKING

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.media_feed import DecodedFeed, PacketFeed, Stream
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.vocabulary import EXPOSURES
from roboglot.drivers.supervisor import Supervisor
from roboglot.extras import lazy
from roboglot.media.h264 import VideoPacket
from roboglot.media.video import VideoStream
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.camera import Camera, Frame, Mount, check_exposure
from roboglot.model.errors import Unconnected
from roboglot.model.feed import Feed, Viewer
from roboglot.model.geometry import wrap_angle

if TYPE_CHECKING:
    import numpy as np
    from av import VideoCodecContext
else:
    np = lazy("numpy")

WIDTH, HEIGHT, RATE = 1280, 720, 30.0  # the manual's
FOV = 1.6755  # rad; not in the manual
FORWARD, ABOVE = 0.08, 0.22  # m, of the lens on a stock EP
QUEUE_MAX, PACKETS_MAX = 4, 30  # pictures
CAPTURE_SECONDS_MAX = 5.0


VideoFeed = PacketFeed[VideoPacket]


def video_feed(clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> VideoFeed:
    """Return the video packets of the robot as they arrive."""

    async def packets() -> AsyncIterator[VideoPacket]:
        async for unit in client.video():
            yield VideoPacket(clock.time(), unit.data, unit.keyframe)

    stream = Stream(client.stream.on, client.stream.off, packets)
    return PacketFeed(
        "video", supervisor, clock, stream, queue_max=PACKETS_MAX, joinable=lambda packet: packet.keyframe
    )


class RoboMasterCamera(Camera):
    """Pictures, decoded while they have viewers; ``stamp`` is their time of arrival."""

    width, height, rate, fov = WIDTH, HEIGHT, RATE, FOV

    def __init__(
        self,
        clock: Clock,
        client: RoboMasterClient,
        supervisor: Supervisor,
        reported: ReportedState,
        packets: VideoFeed,
    ) -> None:
        self._clock, self._client, self._supervisor, self._reported = clock, client, supervisor, reported
        self._exposure = "default"
        self._feed: Feed[Frame] = DecodedFeed(packets, clock, _decoder, _frames, queue_max=QUEUE_MAX)

    async def probe(self) -> None:
        """Send the current exposure. Raises RefusedByRobot if there is no camera."""
        await self._client.camera.exposure(self._exposure)

    @property
    def mount(self) -> Mount:
        body, world = self._reported.imu.orientation, self._reported.gimbal
        return Mount(FORWARD, 0.0, ABOVE, world.pitch - body.pitch, wrap_angle(world.yaw - body.yaw))

    @property
    def exposure(self) -> float:
        return EXPOSURES[self._exposure]

    def set_exposure(self, stops: float) -> None:
        """Set the nearest of the four exposures of an EP."""
        check_exposure(stops)
        word = min(EXPOSURES, key=lambda name: abs(EXPOSURES[name] - stops))
        self._supervisor.send("setting the exposure", self._client.camera.exposure(word))
        self._exposure = word

    async def capture(self) -> Frame:
        """Return the next picture. Raises Unconnected if none arrives."""
        self._supervisor.link.require()
        with self.subscribe() as pictures:
            try:
                return await self._clock.wait_for(anext(pictures), CAPTURE_SECONDS_MAX)
            except (TimeoutError, StopAsyncIteration):
                raise Unconnected("the robot sends no pictures") from None

    def subscribe(self) -> Viewer[Frame]:
        return self._feed.subscribe()


class RoboMasterVideo(VideoStream):
    """The robot's own access units, not encoded again; a new viewer waits for the next key picture."""

    def __init__(self, camera: RoboMasterCamera, clock: Clock, packets: VideoFeed) -> None:
        super().__init__(camera, clock)
        self._packets = packets

    async def _encode(self) -> None:
        with self._packets.subscribe() as packets:
            async for packet in packets:
                self._feed.push(packet)


def _decoder() -> VideoCodecContext:
    import av  # takes a quarter of a second

    codec = av.VideoCodecContext.create("h264", "r")
    codec.thread_count = 1  # more threads delay pictures
    return codec


def _frames(decoder: VideoCodecContext, packet: VideoPacket) -> Sequence[Frame]:
    """Return the picture of a packet at the camera's size; none if it cannot be decoded."""
    from av import FFmpegError, Packet

    try:
        pictures = decoder.decode(Packet(packet.data))
    except FFmpegError:
        return []
    if not pictures:
        return []
    picture = pictures[-1].reformat(width=WIDTH, height=HEIGHT, format="yuv420p")
    planes = np.ascontiguousarray(picture.to_ndarray(), dtype=np.uint8)
    planes.flags.writeable = False
    return [Frame(packet.stamp, planes)]
