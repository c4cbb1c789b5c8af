"""The camera of a dog: live pictures by WebRTC while they have viewers, single ones as photos."""

from __future__ import annotations

import asyncio
import io
import logging
from typing import TYPE_CHECKING

from roboglot.clients.cyberdog import CyberDogClient
from roboglot.clients.errors import BadAnswer, ClientError
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.drivers.supervisor import Supervisor
from roboglot.extras import lazy
from roboglot.media.video import beside
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.camera import Camera, Frame, Mount
from roboglot.model.errors import Refused
from roboglot.model.feed import Feed, Viewer

if TYPE_CHECKING:
    import numpy as np
    from av import VideoFrame
else:
    np = lazy("numpy")

log = logging.getLogger(__name__)
WIDTH, HEIGHT, RATE = 1280, 720, 30.0  # pictures of other sizes are scaled
FOV = 1.2217  # rad; not reported
FORWARD, ABOVE, PITCH = 0.25, 0.34, -0.1  # m and rad above the ground of a standing dog; not reported
PIXELS_MAX = 50_000_000  # of a photo
QUEUE_MAX = 4  # pictures
RETRY = 2.0  # s between two calls
PICTURE_MAX = 5.0  # s without a picture until the next call


class CyberDogCamera(Camera):
    """``stamp`` is the time of arrival. The dog adjusts the brightness by itself."""

    width, height, rate, fov = WIDTH, HEIGHT, RATE, FOV

    def __init__(self, clock: Clock, client: CyberDogClient, supervisor: Supervisor) -> None:
        self._clock, self._client, self._supervisor = clock, client, supervisor
        self._feed: Feed[Frame] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._looking: asyncio.Task[None] | None = None

    async def probe(self) -> None:
        """Probe the camera. Raises CyberDogRefused or NoAnswer if there is none."""
        await self._client.end_video("nobody")

    @property
    def mount(self) -> Mount:
        return Mount(FORWARD, 0.0, ABOVE, PITCH)

    @property
    def exposure(self) -> float:
        return 0.0

    def set_exposure(self, stops: float) -> None:
        if stops:
            raise Refused("a dog's camera adjusts its brightness by itself")

    async def capture(self) -> Frame:
        """Take a photo."""
        self._supervisor.link.require()
        with robot_errors():
            photo = await self._client.photo()
            stamp = self._clock.time()
            return await beside(self._clock, lambda: _frame_of(photo.data, stamp))

    def subscribe(self) -> Viewer[Frame]:
        return self._feed.subscribe()

    def _begin(self) -> None:
        self._looking = asyncio.get_running_loop().create_task(self._look(), name="pictures of a CyberDog")

    def _end(self) -> None:
        if self._looking is not None:
            self._looking.cancel()
            self._looking = None

    async def _look(self) -> None:
        while True:
            try:
                async with self._client.video() as pictures:
                    while True:
                        picture = await self._clock.wait_for(pictures.next(), PICTURE_MAX)
                        self._feed.push(_fitted(picture, self._clock.time()))
            except (ClientError, TimeoutError) as error:
                log.info("%s sends no pictures: %s", self._supervisor.link.address, error)
            except Exception:
                log.exception("video failed")
            await self._clock.sleep(RETRY)


def _frame_of(jpeg: bytes, stamp: float) -> Frame:
    """Decode a photo. Raises BadAnswer."""
    from av import VideoFrame
    from PIL import Image

    try:
        with Image.open(io.BytesIO(jpeg), formats=("JPEG",)) as photo:
            if photo.width * photo.height > PIXELS_MAX:
                raise BadAnswer(f"a photo of {photo.width} by {photo.height} pixels")
            return _fitted(VideoFrame.from_ndarray(np.asarray(photo.convert("RGB")), format="rgb24"), stamp)
    except (OSError, ValueError) as error:
        raise BadAnswer(f"the photo cannot be read: {error}") from None


def _fitted(picture: VideoFrame, stamp: float) -> Frame:
    fitted = picture.reformat(width=WIDTH, height=HEIGHT, format="yuv420p", dst_color_range="MPEG")
    planes = np.ascontiguousarray(fitted.to_ndarray(), dtype=np.uint8)
    planes.flags.writeable = False
    return Frame(stamp, planes)
