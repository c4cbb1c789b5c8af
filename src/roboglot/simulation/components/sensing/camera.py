"""The camera: draws the world's present state at its rate, only while it has viewers."""

from __future__ import annotations

import asyncio
import logging
import math
from functools import partial
from typing import TYPE_CHECKING, Annotated

import numpy as np
from msgspec import Meta, Struct

from roboglot.model.clock import Clock, RealClock
from roboglot.model.components.sensing.camera import (
    Camera,
    Frame,
    Mount,
    check_exposure,
)
from roboglot.model.feed import Feed, Viewer
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.components.motion.gimbal_axes import GimbalSection
from roboglot.simulation.rendering.render_pool import RenderPool
from roboglot.simulation.rendering.views import Eye, Instant, Scenery
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.rendering.picture import Renderer

log = logging.getLogger(__name__)
QUEUE_MAX = 2  # pictures by which a viewer may lag
WINDOW = 5.0  # s over which pictures are counted
ENOUGH, RECOVERED = 0.8, 0.95  # share of the pictures: below the first a warning, from the second it is over


class CameraSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``fov``: horizontal, rad; ``forward``, ``above_belly``: position, m; ``pitch``: rad, nose down; ``rate``: Hz."""

    width: Annotated[int, Meta(ge=64, le=1920, multiple_of=16)]
    height: Annotated[int, Meta(ge=64, le=1080, multiple_of=2)]
    rate: Annotated[float, Meta(gt=0, le=60)]
    fov: Annotated[float, Meta(gt=0.1, lt=2.5)]
    forward: Annotated[float, Meta(ge=-5, le=5)]
    above_belly: NotNegative
    pitch: Annotated[float, Meta(ge=-1.5, le=1.5)] = 0.0


@dataclass(frozen=True, slots=True)
class _Shot:
    """Everything needed to draw a picture."""

    stage: Scenery
    renderer: Renderer
    stamp: float
    instant: Instant
    eye: Eye
    gain: float

    def develop(self) -> Frame:
        """Draw the picture; takes some milliseconds, in any thread, one at a time per renderer.

        An unchanged view is not drawn again.
        """
        key = self.instant.key(), self.eye.key(), self.gain
        scene = partial(self.stage.scene, self.instant)
        return Frame(self.stamp, self.renderer.develop(key, scene, self.eye, self.gain))


class Shortfall:
    """Log of a camera whose pictures fall short of its rate."""

    def __init__(self, robot: str, rate: float) -> None:
        self._robot, self._rate = robot, rate
        self._began: float | None = None
        self._pictures = 0
        self._short = False

    def note(self, now: float) -> None:
        """Count a picture; judge the rate at the end of a window of robot time."""
        if self._began is None:
            self._began = now
            return
        self._pictures += 1
        if now - self._began < WINDOW:
            return
        rate = self._pictures / (now - self._began)
        self._began, self._pictures = now, 0
        short = rate < (RECOVERED if self._short else ENOUGH) * self._rate
        if short and not self._short:
            log.warning(
                "the camera of %s takes %.1f of %g pictures a second: this machine is too slow for more",
                self._robot, rate, self._rate,
            )  # fmt: skip
        elif self._short and not short:
            log.info("the camera of %s takes %.1f of %g pictures a second again", self._robot, rate, self._rate)
        self._short = short


class SimulatedCamera(Camera):
    """Camera at the front of the torso, moving with it. No noise, no lens errors, no motion blur."""

    def __init__(self, section: CameraSection, hull: Hull, render_pool: RenderPool, clock: Clock) -> None:
        self.width, self.height, self.rate, self.fov = section.width, section.height, section.rate, section.fov
        self._section, self._hull, self._render_pool, self._clock = section, hull, render_pool, clock
        self._exposure = 0.0
        self._renderer: Renderer | None = None
        self._preparing: asyncio.Task[None] | None = None
        self._busy = asyncio.Lock()
        self._feed: Feed[Frame] = Feed(self._begin, self._end, queue_max=QUEUE_MAX)
        self._filming: asyncio.Task[None] | None = None
        self.drawn = 0  # number of pictures so far

    @property
    def mount(self) -> Mount:
        section, (pitch, yaw) = self._section, self._hull.gaze
        gimbal = self._hull.body.get(GimbalSection)
        middle = gimbal.forward if gimbal else 0.0
        ahead = section.forward - middle  # distance from the gimbal's axis, with which the camera turns
        at = np.array(((middle + ahead * math.cos(yaw), ahead * math.sin(yaw), section.above_belly),))
        hull, (x, y, z) = self._hull, self._hull.held(at)[0].tolist()
        held = hull.attitude  # mounts have no roll; pictures do
        pitch += section.pitch + held.pitch
        return Mount(x + hull.shift.x, y + hull.shift.y, hull.belly + z, pitch, yaw + held.yaw)

    @property
    def exposure(self) -> float:
        return self._exposure

    def set_exposure(self, stops: float) -> None:
        check_exposure(stops)
        self._exposure = stops

    @property
    def delay(self) -> str:
        return self._render_pool.delay

    def prepare(self) -> None:
        """Load the renderer and draw once, in the background; do nothing in lockstep."""
        if isinstance(self._clock, RealClock) and self._renderer is None and self._preparing is None:
            self._preparing = asyncio.get_running_loop().create_task(self._prepare(), name="camera gets ready")

    async def _prepare(self) -> None:
        try:
            await self.capture()
        except Exception:
            log.exception("the camera cannot draw")

    async def capture(self) -> Frame:
        # In a separate task: a drawing thread cannot be cancelled, and its renderer stays in use until it ends.
        return await asyncio.shield(asyncio.get_running_loop().create_task(self._capture()))

    async def _capture(self) -> Frame:
        async with self._busy:
            stage = await self._render_pool.stage()
            if self._renderer is None:
                self._renderer = await self._render_pool.renderer(self.width, self.height, self.fov)
            shot = self._shoot(stage, self._renderer)
            self.drawn += 1
            return await self._render_pool.work(shot.develop)

    def subscribe(self) -> Viewer[Frame]:
        return self._feed.subscribe()

    def close(self) -> None:
        """Take no more pictures."""
        self._feed.close()

    def _shoot(self, stage: Scenery, renderer: Renderer) -> _Shot:
        """Freeze the visible state of the world."""
        hull, mount = self._hull, self.mount
        pitch, yaw = hull.gaze
        axes = rotation((0.0, self._section.pitch + pitch), yaw).T[[1, 2, 0]] * ((-1.0,), (-1.0,), (1.0,))
        axes = hull.held(axes)  # to the right, down, ahead
        x, y, z = hull.to_world(np.array(((mount.x, mount.y, mount.z),)))[0].tolist()
        eye = Eye(hull.pose.x + x, hull.pose.y + y, hull.elevation + z, hull.to_world(axes), self.fov)
        instant = stage.instant(hull.floor, hull, eye)
        return _Shot(stage, renderer, self._clock.time(), instant, eye, 2.0**self._exposure)

    def _begin(self) -> None:
        self._filming = asyncio.get_running_loop().create_task(self._film(), name="camera")

    def _end(self) -> None:
        if self._filming is not None:
            self._filming.cancel()
            self._filming = None

    async def _film(self) -> None:
        try:
            shortfall = Shortfall(self._hull.name, self.rate)
            self._feed.push(await self.capture())
            async for now in self._clock.every(1.0 / self.rate):  # which skips beats while a picture takes too long
                if self._feed.unread and isinstance(self._clock, RealClock):
                    continue  # the encoder does not keep up: a picture that it would drop is not worth drawing
                self._feed.push(await self.capture())
                shortfall.note(now)
        except Exception:
            log.exception("the camera crashed")
            self._filming = None
            self._feed.close()


def _fit(fit: Fitting) -> SimulatedCamera:
    return SimulatedCamera(fit.body[CameraSection], fit.hull, fit.world.render_pool, fit.robot.clock)


PART = Part(name="camera", interface=Camera, section=CameraSection, fit=_fit, detach=SimulatedCamera.close)
