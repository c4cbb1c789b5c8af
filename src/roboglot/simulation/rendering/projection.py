"""A camera's view at an instant: projects places of the world into its picture. Plain geometry, no occlusion."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.sensing.camera import Camera
from roboglot.model.perception import Box
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.values import dataclass

Floats = NDArray[np.float64]
NEAREST = 0.05  # m in front of the lens; nearer things are not drawn


@dataclass(frozen=True, slots=True)
class View:
    """``at``: the lens (world, m). ``rotation``: rows right, down and ahead in world. ``fov``: horizontal, rad."""

    at: Floats
    rotation: Floats
    fov: float
    aspect: float  # width / height

    def project(self, points: Floats) -> tuple[Floats, Floats]:
        """Return the points' (n, 3; world) places in the picture (n, 2; 0..1 inside) and depths, m.

        Places of points behind the lens are NaN.
        """
        seen = (points - self.at) @ self.rotation.T
        ahead = np.where(seen[:, 2] > NEAREST, seen[:, 2], np.nan)
        focal = 0.5 / math.tan(self.fov / 2)  # in picture widths
        x = 0.5 + focal * seen[:, 0] / ahead
        y = 0.5 + focal * self.aspect * seen[:, 1] / ahead
        return np.stack((x, y), axis=1), seen[:, 2]

    def inside(self, places: Floats) -> NDArray[np.bool_]:
        """Return which places (n, 2) lie within the picture."""
        within: NDArray[np.bool_] = np.all((places >= 0.0) & (places <= 1.0), axis=1)
        return within

    def box(self, corners: Floats) -> Box | None:
        """Return the picture's part covered by a body with these corners (n, 3; world); None if not wholly ahead."""
        places, _ = self.project(corners)
        if np.isnan(places).any():
            return None
        (x0, y0), (x1, y1) = places.min(axis=0).clip(0.0, 1.0).tolist(), places.max(axis=0).clip(0.0, 1.0).tolist()
        if x1 <= x0 or y1 <= y0:
            return None
        return Box((x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0)

    @staticmethod
    def corners(low: Floats, high: Floats) -> Floats:
        """Return the eight corners of a block (8, 3)."""
        return np.array([(x, y, z) for x in (low[0], high[0]) for y in (low[1], high[1]) for z in (low[2], high[2])])


def view_of(camera: Camera, hull: Hull) -> View:
    """Return the current view of a robot's camera."""
    mount = camera.mount
    ahead, left, up = rotation((0.0, mount.pitch), mount.yaw).T
    axes = hull.to_world(np.array((-left, -up, ahead)))
    off = hull.to_world(np.array(((mount.x, mount.y, mount.z),)))[0]
    at = np.array((hull.pose.x, hull.pose.y, hull.elevation)) + off
    return View(at, axes, camera.fov, camera.width / camera.height)
