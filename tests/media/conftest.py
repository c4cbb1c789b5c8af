"""Cameras and microphones made of arrays, for encoders that know no robot."""

from __future__ import annotations

import asyncio

import numpy as np
import pytest

from roboglot.model.clock import LockstepClock
from roboglot.model.components.sensing.camera import Camera, Frame, Mount
from roboglot.model.feed import Feed

WIDTH, HEIGHT = 320, 176


def picture(number: int, stamp: float = 0.0) -> Frame:
    """Grey slopes with a bright bar whose place encodes the number: 8 pixels further right each time."""
    planes = np.full((HEIGHT * 3 // 2, WIDTH), 128, np.uint8)
    planes[:HEIGHT] = 40 + np.arange(HEIGHT)[:, None] // 2
    planes[:HEIGHT, 8 * number : 8 * number + 8] = 220
    return Frame(stamp, planes)


def number_of(luma: np.ndarray) -> int:
    """Return the number of that picture."""
    return int(luma[: HEIGHT // 2].astype(int).sum(0).argmax()) // 8


class BarCamera(Camera):
    """A new picture 30 times a second while someone looks."""

    width, height, rate, fov = WIDTH, HEIGHT, 30.0, 1.0
    mount = Mount(0, 0, 0)
    exposure = 0.0

    def __init__(self, clock):
        self.clock, self.taken, self.task = clock, 0, None
        self.feed = Feed(self._begin, self._end, queue_max=2)

    def set_exposure(self, stops):
        raise NotImplementedError

    async def capture(self):
        self.taken += 1
        return picture((self.taken - 1) % 38, self.clock.time())

    def subscribe(self):
        return self.feed.subscribe()

    def _begin(self):
        self.task = asyncio.get_running_loop().create_task(self._film())

    def _end(self):
        self.task.cancel()

    async def _film(self):
        async for _ in self.clock.every(1 / self.rate):
            self.feed.push(await self.capture())


@pytest.fixture
def lockstep():
    return LockstepClock()


@pytest.fixture
def camera(lockstep):
    return BarCamera(lockstep)
