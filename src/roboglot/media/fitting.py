"""A camera's pictures in another shape: scaled to a width, then cut or padded in black to a height."""

from __future__ import annotations

import asyncio
import logging
from functools import partial
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.media.video import beside
from roboglot.model.clock import Clock
from roboglot.model.components.sensing.camera import Camera, Frame
from roboglot.model.feed import Feed, Viewer

if TYPE_CHECKING:
    import numpy as np
    from av import VideoFrame
    from numpy.typing import NDArray
else:
    np = lazy("numpy")

log = logging.getLogger(__name__)
QUEUE_MAX = 4  # pictures
BLACK = (16, 128)  # luma, chroma


class FittedPictures:
    """Pictures of ``camera`` at ``width`` x ``height`` (even numbers of pixels), made only while there are viewers.

    ``place``: 0 keeps the picture at the upper edge, 1 at the lower, 0.5 in the middle.
    """

    def __init__(self, camera: Camera, clock: Clock, width: int, height: int, place: float) -> None:
        if width % 2 or height % 2 or min(width, height) <= 0:
            raise ValueError(f"4:2:0 pictures have even sizes, not {width} x {height}")
        self.width, self.height, self.rate = width, height, camera.rate
        self._camera, self._clock, self._place = camera, clock, place
        self._feed: Feed[Frame] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._fitting: asyncio.Task[None] | None = None

    def subscribe(self) -> Viewer[Frame]:
        """Return a viewer of the pictures from now on."""
        return self._feed.subscribe()

    def _begin(self) -> None:
        self._fitting = asyncio.get_running_loop().create_task(self._run(), name="fitted pictures")

    def _end(self) -> None:
        if self._fitting is not None:
            self._fitting.cancel()
            self._fitting = None

    async def _run(self) -> None:
        try:
            with self._camera.subscribe() as pictures:
                async for frame in pictures:
                    self._feed.push(await beside(self._clock, partial(self.fit, frame)))
        except Exception:
            log.exception("the fitted pictures crashed")
        self._fitting = None
        self._feed.close()

    def fit(self, frame: Frame) -> Frame:
        """Return ``frame`` in the other shape."""
        from av import VideoFrame

        scaled = 2 * round(frame.height * self.width / frame.width / 2)
        picture: VideoFrame = VideoFrame.from_numpy_buffer(frame.planes, format="yuv420p")
        scaled_planes = picture.reformat(width=self.width, height=scaled).to_ndarray()
        small = Frame(frame.stamp, scaled_planes.astype(np.uint8, copy=False))
        if scaled == self.height:
            return small
        planes = np.empty((self.height * 3 // 2, self.width), np.uint8)
        planes[: self.height], planes[self.height :] = BLACK
        fitted = Frame(frame.stamp, planes)
        # The offset of the upper edge: negative if the picture is higher than the frame.
        top = 2 * round((self.height - scaled) * self._place / 2)
        _paste(small.luma, fitted.luma, top)
        for small_plane, plane in zip(small.chroma, fitted.chroma, strict=True):
            _paste(small_plane, plane, top // 2)
        return fitted


def _paste(source: NDArray[np.uint8], target: NDArray[np.uint8], top: int) -> None:
    """Copy ``source`` into ``target``, ``top`` rows below its upper edge, as far as it fits."""
    rows = source[max(0, -top) : max(0, -top) + target.shape[0] - max(0, top)]
    target[max(0, top) : max(0, top) + rows.shape[0]] = rows
