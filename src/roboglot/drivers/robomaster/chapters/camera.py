"""The EP's camera: its H.264 is passed on as it comes, and decoded for those who want pictures.

The robot films while somebody looks at either.
"""

from __future__ import annotations

from collections.abc import AsyncIterator, Sequence
from typing import TYPE_CHECKING

import numpy as np

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.robomaster.media_feed import DecodedFeed, PacketFeed
from roboglot.drivers.robomaster.state import ReportedState
from roboglot.drivers.robomaster.vocabulary import EXPOSURES
from roboglot.drivers.supervisor import Supervisor
from roboglot.media.h264 import VideoPacket
from roboglot.media.video import VideoStream
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.camera import (
    EXPOSURE_MAX,
    Camera,
    Frame,
    Mount,
)
from roboglot.model.errors import InvalidGoal, Unconnected
from roboglot.model.feed import Feed, Viewer
from roboglot.model.geometry import wrap_angle

if TYPE_CHECKING:
    from av import VideoCodecContext

WIDTH, HEIGHT, RATE = 1280, 720, 30.0  # the manual's
FOV = 1.6755  # rad; not in the manual
FORWARD, ABOVE = 0.08, 0.22  # m, of the lens: an EP as it is delivered
QUEUE_MAX, PACKETS_MAX = 4, 30  # pictures
CAPTURE_SECONDS_MAX = 5.0


Film = PacketFeed[VideoPacket]


def film(clock: Clock, client: RoboMasterClient, supervisor: Supervisor) -> Film:
    """What the robot films, as it comes."""

    async def packets() -> AsyncIterator[VideoPacket]:
        async for unit in client.video():
            yield VideoPacket(clock.time(), unit.data, unit.keyframe)

    return PacketFeed(
        "video", supervisor, clock, client.stream.on, client.stream.off, packets,
        queue_max=PACKETS_MAX, joinable=lambda packet: packet.keyframe,
    )  # fmt: skip


class RoboMasterCamera(Camera):
    """Pictures are decoded while somebody looks; ``stamp`` is when they came."""

    width, height, rate, fov = WIDTH, HEIGHT, RATE, FOV

    def __init__(
        self, clock: Clock, client: RoboMasterClient, supervisor: Supervisor, reported: ReportedState, film: Film
    ) -> None:
        self._clock, self._client, self._supervisor, self._reported = clock, client, supervisor, reported
        self._exposure = "default"
        self._feed: Feed[Frame] = DecodedFeed(film, clock, _decoder, _frames, queue_max=QUEUE_MAX)

    async def learn(self) -> None:
        """Tell it the exposure that it has. Raises RefusedByRobot if there is no camera."""
        await self._client.camera.exposure(self._exposure)

    @property
    def mount(self) -> Mount:
        body, world = self._reported.imu.orientation, self._reported.gimbal
        return Mount(FORWARD, 0.0, ABOVE, world.pitch - body.pitch, wrap_angle(world.yaw - body.yaw))

    @property
    def exposure(self) -> float:
        return EXPOSURES[self._exposure]

    def set_exposure(self, stops: float) -> None:
        """The nearest of the four that an EP knows."""
        if not abs(stops) <= EXPOSURE_MAX:
            raise InvalidGoal(f"an exposure is up to {EXPOSURE_MAX} stops, not {stops}")
        word = min(EXPOSURES, key=lambda name: abs(EXPOSURES[name] - stops))
        self._supervisor.send("setting the exposure", self._client.camera.exposure(word))
        self._exposure = word

    async def capture(self) -> Frame:
        """The next picture. Raises Unconnected when none comes."""
        self._supervisor.link.require()
        with self.subscribe() as pictures:
            try:
                return await self._clock.wait_for(anext(pictures), CAPTURE_SECONDS_MAX)
            except (TimeoutError, StopAsyncIteration):
                raise Unconnected("the robot sends no pictures") from None

    def subscribe(self) -> Viewer[Frame]:
        return self._feed.subscribe()


class RoboMasterVideo(VideoStream):
    """The robot's own access units: nothing is encoded again, and a newcomer waits for the robot's next key picture."""

    def __init__(self, camera: RoboMasterCamera, clock: Clock, film: Film) -> None:
        super().__init__(camera, clock)
        self._film = film

    async def _encode(self) -> None:
        with self._film.subscribe() as packets:
            async for packet in packets:
                self._feed.push(packet)


def _decoder() -> VideoCodecContext:
    import av  # a quarter of a second

    codec = av.VideoCodecContext.create("h264", "r")
    codec.thread_count = 1  # more hold pictures back
    return codec


def _frames(decoder: VideoCodecContext, packet: VideoPacket) -> Sequence[Frame]:
    """The packet's picture in the size that the camera promises; none for what cannot be decoded."""
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
