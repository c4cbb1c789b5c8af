"""Renderers of a world's cameras: kernels are loaded for the first one; with a real clock, threads do the work.

In lockstep everything runs in place, so that the same seed gives the same pictures at the same instants.
"""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Callable
from typing import TYPE_CHECKING, TypeVar

from roboglot.kernels import CAMERA, loading
from roboglot.kernels.ahead import KernelsUnavailable, compile_beside, missing
from roboglot.model.background import beside, load
from roboglot.model.clock import Clock, RealClock
from roboglot.simulation.rendering.views import Scenery

if TYPE_CHECKING:
    from roboglot.simulation.rendering.picture import Renderer

R = TypeVar("R")


class RenderPool:
    """Scenery and renderers for all cameras of one world; costs nothing until the first ``stage``."""

    def __init__(self, open_stage: Callable[[], Scenery], clock: Clock) -> None:
        self._open_stage = open_stage
        self._threaded = isinstance(clock, RealClock)
        self._stage: Scenery | None = None
        self._opening = asyncio.Lock()
        self.delay = ""  # why the first picture takes long, a sentence

    async def stage(self) -> Scenery:
        """Return the scenery; the first call waits for the kernels (a second; longer if they must be compiled)."""
        async with self._opening:
            if self._stage is None:
                self._stage = await self._load(self._open_stage)
        return self._stage

    async def renderer(self, width: int, height: int, fov: float) -> Renderer:
        """Return the buffers for one camera."""

        def make() -> Renderer:
            with loading():
                from roboglot.simulation.rendering.picture import Renderer

            return Renderer(width, height, fov)

        return await self._load(make)

    async def _load(self, job: Callable[[], R]) -> R:
        """Return the result of ``job``, which imports kernels: missing ones are compiled first, in a separate process.

        Compiled in a thread of the pool, they would slow the robots down and delay the program's end.
        """
        if not self._threaded:
            return job()
        if missing(CAMERA):
            why = "the first picture waits until the kernels that draw it are compiled: up to a minute, once"
            self.delay = why
        try:
            with contextlib.suppress(KernelsUnavailable):  # then they are compiled as they are imported
                await compile_beside(CAMERA)
            return await load(job)
        finally:
            self.delay = ""

    async def work(self, job: Callable[[], R]) -> R:
        """Return the result of ``job``, which runs in a thread in real time."""
        return await beside(job) if self._threaded else job()
