"""The EP's camera: its H.264 is passed on as it comes, and decoded for those who want pictures.

The robot films while somebody looks at either.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from typing import TYPE_CHECKING

import numpy as np

from roboglot.clients.errors import ClientError
from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.keeper import Keeper
from roboglot.drivers.robomaster.newest import Newest
from roboglot.drivers.robomaster.vocabulary import EXPOSURES
from roboglot.media.h264 import VideoPacket
from roboglot.media.video import VideoStream, beside
from roboglot.model.clock import Clock
from roboglot.model.components.camera import EXPOSURE_MAX, Camera, Frame, Mount
from roboglot.model.errors import InvalidGoal, RobotError, Unconnected
from roboglot.model.feed import Feed, Viewer
from roboglot.model.geometry import wrap_angle

if TYPE_CHECKING:
    from av import VideoCodecContext

log = logging.getLogger(__name__)
WIDTH, HEIGHT, RATE = 1280, 720, 30.0  # the manual's
FOV = 1.6755  # rad; not in the manual
FORWARD, ABOVE = 0.08, 0.22  # m, of the lens: an EP as it is delivered
QUEUE_MAX, PACKETS_MAX = 4, 30  # pictures
RETRY = 1.0  # s until the video port is tried again
CAPTURE_SECONDS_MAX = 5.0


class Film(Feed[VideoPacket]):
    """What the robot films, for the camera and the video alike. The link may come and go meanwhile."""

    def __init__(self, clock: Clock, client: RoboMasterClient, keeper: Keeper) -> None:
        super().__init__(self._start, self._stop, queue_max=PACKETS_MAX, joinable=lambda packet: packet.keyframe)
        self._clock, self._client, self._keeper = clock, client, keeper
        self._filming: asyncio.Task[None] | None = None

    def _start(self) -> None:
        self._filming = asyncio.get_running_loop().create_task(self._run(), name="video of a RoboMaster")

    def _stop(self) -> None:
        if self._filming is not None:
            self._filming.cancel()
            self._filming = None
        with contextlib.suppress(RobotError):  # without a link the video has ended anyway
            self._keeper.send("stopping the video", self._client.stream.off())

    async def _run(self) -> None:
        while True:
            try:
                await self._client.stream.on()
                async for unit in self._client.video():
                    self.push(VideoPacket(self._clock.time(), unit.data, unit.keyframe))
            except ClientError as error:
                log.info("%s: no video: %s", self._keeper.link.address, error)
            await self._clock.sleep(RETRY)


class RoboMasterCamera(Camera):
    """Pictures are decoded while somebody looks; ``stamp`` is when they came."""

    width, height, rate, fov = WIDTH, HEIGHT, RATE, FOV

    def __init__(self, clock: Clock, client: RoboMasterClient, keeper: Keeper, newest: Newest, film: Film) -> None:
        self._clock, self._client, self._keeper, self._newest, self._film = clock, client, keeper, newest, film
        self._exposure = "default"
        self._feed: Feed[Frame] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._decoding: asyncio.Task[None] | None = None

    async def learn(self) -> None:
        """Tell it the exposure that it has. Raises RefusedByRobot if there is no camera."""
        await self._client.camera.exposure(self._exposure)

    @property
    def mount(self) -> Mount:
        body, world = self._newest.imu.orientation, self._newest.gimbal
        return Mount(FORWARD, 0.0, ABOVE, world.pitch - body.pitch, wrap_angle(world.yaw - body.yaw))

    @property
    def exposure(self) -> float:
        return EXPOSURES[self._exposure]

    def set_exposure(self, stops: float) -> None:
        """The nearest of the four that an EP knows."""
        if not abs(stops) <= EXPOSURE_MAX:
            raise InvalidGoal(f"an exposure is up to {EXPOSURE_MAX} stops, not {stops}")
        word = min(EXPOSURES, key=lambda name: abs(EXPOSURES[name] - stops))
        self._keeper.send("setting the exposure", self._client.camera.exposure(word))
        self._exposure = word

    async def capture(self) -> Frame:
        """The next picture. Raises Unconnected when none comes."""
        self._keeper.link.require()
        with self.subscribe() as pictures:
            try:
                return await self._clock.wait_for(anext(pictures), CAPTURE_SECONDS_MAX)
            except (TimeoutError, StopAsyncIteration):
                raise Unconnected("the robot sends no pictures") from None

    def subscribe(self) -> Viewer[Frame]:
        return self._feed.subscribe()

    def _begin(self) -> None:
        self._decoding = asyncio.get_running_loop().create_task(self._decode(), name="pictures of a RoboMaster")

    def _end(self) -> None:
        if self._decoding is not None:
            self._decoding.cancel()
            self._decoding = None

    async def _decode(self) -> None:
        try:
            with self._film.subscribe() as packets:
                decoder = await beside(self._clock, _decoder)
                async for packet in packets:
                    frame = await beside(self._clock, lambda p=packet: _frame(decoder, p))  # type: ignore[misc]
                    if frame is not None:
                        self._feed.push(frame)
        except Exception:
            log.exception("the pictures broke")
        self._decoding = None
        self._feed.close()


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


def _frame(decoder: VideoCodecContext, packet: VideoPacket) -> Frame | None:
    """The packet's picture in the size that the camera promises; None for what cannot be decoded."""
    from av import FFmpegError, Packet

    try:
        pictures = decoder.decode(Packet(packet.data))
    except FFmpegError:
        return None
    if not pictures:
        return None
    picture = pictures[-1].reformat(width=WIDTH, height=HEIGHT, format="yuv420p")
    planes = np.ascontiguousarray(picture.to_ndarray(), dtype=np.uint8)
    planes.flags.writeable = False
    return Frame(packet.stamp, planes)
