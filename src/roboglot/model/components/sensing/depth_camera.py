"""The depth camera."""

from __future__ import annotations

import math
from abc import abstractmethod
from functools import lru_cache
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.components.component import Component
from roboglot.model.geometry import Orientation, Vector3
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


@dataclass(frozen=True, slots=True)
class DepthImage:
    """``depths`` (rows x columns, float32) along the optical axis, m; inf where nothing came back.

    ``mount`` and ``attitude`` say where the camera sits in base_link; ``width`` and ``height`` are its field of view in
    rad.
    """

    stamp: float
    depths: NDArray[np.float32]
    mount: Vector3
    attitude: Orientation
    width: float
    height: float

    @property
    def rays(self) -> NDArray[np.float64]:
        """Vector (rows x columns x 3) of each pixel in base_link per 1 m along the optical axis; read only."""
        rows, columns = self.depths.shape
        return _rays(rows, columns, self.width, self.height, self.attitude.pitch)

    @property
    def points(self) -> NDArray[np.float32]:
        """Measured points (n, 3): x, y, z in base_link, m, z above the floor."""
        seen = np.isfinite(self.depths)
        points = self.rays[seen] * self.depths[seen][:, None]
        points += (self.mount.x, self.mount.y, self.mount.z)
        return points.astype(np.float32)


class DepthCamera(Component):
    """Takes images on request, at most ``rate`` per second."""

    rate: float
    connected: bool = True  # whether it responds; without a response there is no image

    @property
    @abstractmethod
    def image(self) -> DepthImage | None:
        """Latest image; None before the first, and while switched off or masked."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if it takes images."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch it."""


@lru_cache(maxsize=64)
def _rays(rows: int, columns: int, width: float, height: float, pitch: float) -> NDArray[np.float64]:
    across = np.tan(np.linspace(width / 2, -width / 2, columns))
    down = np.tan(np.linspace(height / 2, -height / 2, rows))
    left, up = np.meshgrid(across, down)
    c, s = math.cos(pitch), math.sin(pitch)
    rays: NDArray[np.float64] = np.stack((c + s * up, left, c * up - s), axis=-1)
    return rays
