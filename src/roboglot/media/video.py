"""The camera as live video, encoded once for all viewers, and only while there is one."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable
from functools import partial
from typing import Protocol, TypeVar

from roboglot.media.h264 import H264Encoder, VideoPacket
from roboglot.model import background
from roboglot.model.clock import Clock, RealClock
from roboglot.model.components.component import Component
from roboglot.model.components.sensing.camera import Frame
from roboglot.model.feed import Feed, Viewer

log = logging.getLogger(__name__)
R = TypeVar("R")
QUEUE_MAX = 30  # packets, one second; a viewer further behind resumes at the next keyframe


async def beside(clock: Clock, job: Callable[[], R]) -> R:
    """Return the result of ``job``, run in a thread in real time, in place in lockstep to keep the order."""
    return await background.beside(job) if isinstance(clock, RealClock) else job()


class Pictures(Protocol):
    """Source of video: a Camera, or its pictures in another shape."""

    width: int
    height: int
    rate: float

    def subscribe(self) -> Viewer[Frame]: ...


class VideoStream(Component):
    """H.264 of the camera at its rate: ``robot[VideoStream].subscribe()``. New viewers get a keyframe at once."""

    def __init__(self, camera: Pictures, clock: Clock) -> None:
        self._camera, self._clock = camera, clock
        self._feed: Feed[VideoPacket] = Feed(
            self._begin, self._end, queue_max=QUEUE_MAX, joinable=lambda packet: packet.keyframe
        )
        self._encoding: asyncio.Task[None] | None = None
        self._keyframe_wanted = False

    @property
    def size(self) -> tuple[int, int]:
        """Width and height, pixels."""
        return self._camera.width, self._camera.height

    @property
    def rate(self) -> float:
        """Pictures per second."""
        return self._camera.rate

    def subscribe(self) -> Viewer[VideoPacket]:
        """Return a viewer of the packets from the next picture on, which is a keyframe."""
        viewer = self._feed.subscribe()
        self.request_keyframe()
        return viewer

    def request_keyframe(self) -> None:
        """Make the next picture a keyframe, for viewers that lost packets."""
        self._keyframe_wanted = True

    def _begin(self) -> None:
        self._encoding = asyncio.get_running_loop().create_task(self._encode(), name="video")

    def _end(self) -> None:
        if self._encoding is not None:
            self._encoding.cancel()
            self._encoding = None

    async def _encode(self) -> None:
        camera = self._camera
        try:
            with camera.subscribe() as pictures:
                encoder = await beside(self._clock, lambda: H264Encoder(camera.width, camera.height, camera.rate))
                async for frame in pictures:
                    keyframe, self._keyframe_wanted = self._keyframe_wanted, False
                    self._feed.push(await beside(self._clock, partial(encoder.encode, frame, keyframe=keyframe)))
        except Exception:
            log.exception("the video crashed")
        self._encoding = None
        self._feed.close()
