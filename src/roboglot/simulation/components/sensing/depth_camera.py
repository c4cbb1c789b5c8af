"""A depth camera that looks ahead and down, by rays in the physics: sees all solids at every height."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.depth_camera import DepthCamera, DepthImage
from roboglot.model.events import Rebooted
from roboglot.model.geometry import Orientation, Vector3
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays

SIGMAS = 10.0  # of noise at the range's end: what lies farther off is never seen
Floats = NDArray[np.float64]


class DepthCameraSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Position ``above_ground`` and ``forward`` of the middle, m; ``pitch`` down and field of view, rad."""

    rows: Annotated[int, Meta(ge=2, le=240)]
    columns: Annotated[int, Meta(ge=2, le=320)]
    width: Annotated[float, Meta(gt=0, lt=3)]
    height: Annotated[float, Meta(gt=0, lt=3)]
    rate: Annotated[float, Meta(gt=0, le=30)]
    range_min: NotNegative
    range_max: Positive
    noise: NotNegative
    above_ground: Positive
    forward: Annotated[float, Meta(ge=-5, le=5)]
    pitch: Annotated[float, Meta(ge=-1.5, le=1.5)] = 0.0


class SimulatedDepthCamera(DepthCamera):
    """Depth camera that takes an image when read, at most at its rate; noise grows with the depth squared."""

    def __init__(
        self, section: DepthCameraSection, hull: Hull, rays: Rays, clock: Clock, random: np.random.Generator
    ) -> None:
        self._section, self._hull, self._rays, self._clock, self._random = section, hull, rays, clock, random
        self.rate = section.rate
        self.masked = False
        self._enabled = True
        self._image: DepthImage | None = None
        self._optical = _bundle(section)
        c, s = math.cos(section.pitch), math.sin(section.pitch)
        sigma = section.noise * section.range_max**2
        self._reach = (section.range_max + SIGMAS * sigma) / float(self._optical[:, 0].min())  # m along a ray
        self._ahead = np.ascontiguousarray(self._optical[:, 0])
        self._place = np.array(((section.forward, 0.0, section.above_ground),))
        self._directions = self._optical @ np.array(((c, 0.0, -s), (0.0, 1.0, 0.0), (s, 0.0, c)))  # base_link

    @property
    def enabled(self) -> bool:
        return self._enabled

    def enable(self, on: bool) -> None:
        self._enabled = on

    @property
    def image(self) -> DepthImage | None:
        if not self._enabled or self.masked or not self.connected:
            return None
        now = self._clock.time()
        if self._image is None or now - self._image.stamp >= 1.0 / self.rate - 1e-6:
            self._image = self._take(now)
        return self._image

    def _take(self, stamp: float) -> DepthImage:
        section, hull = self._section, self._hull
        ways = self._rays.look(self._place, self._directions, self._reach, hull)
        noise, limits = self._random.standard_normal(len(ways)), (section.range_min, section.range_max, math.inf)
        depths = self._rays.reading(ways, self._ahead, noise, (0.0, section.noise), limits)
        image = depths.reshape(section.rows, section.columns)
        image.setflags(write=False)
        mount = Vector3(section.forward, 0.0, section.above_ground)
        attitude = Orientation(pitch=section.pitch)
        return DepthImage(stamp, image, mount, attitude, section.width, section.height)


def _bundle(section: DepthCameraSection) -> Floats:
    """Return a unit vector for every pixel (n x 3): x along the optical axis, y left, z up; rows from the top."""
    across = np.tan(np.linspace(section.width / 2, -section.width / 2, section.columns))
    down = np.tan(np.linspace(section.height / 2, -section.height / 2, section.rows))
    y, z = np.meshgrid(across, down)
    rays = np.stack((np.ones_like(y), y, z), axis=-1).reshape(-1, 3)
    return np.asarray(rays / np.linalg.norm(rays, axis=1, keepdims=True))


def _fit(fit: Fitting) -> SimulatedDepthCamera:
    section, chance = fit.body[DepthCameraSection], fit.chance("depth camera")
    camera = SimulatedDepthCamera(section, fit.hull, fit.world.rays, fit.robot.clock, chance)
    fit.robot.events.listen(Rebooted, lambda _: camera.enable(True))
    return camera


PART = Part(name="depth_camera", interface=DepthCamera, section=DepthCameraSection, fit=_fit)
