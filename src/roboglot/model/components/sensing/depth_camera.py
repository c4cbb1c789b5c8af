"""Depth cameras, and switching sensors off."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboglot.model.components.component import Component
from roboglot.model.geometry import Orientation, Vector3

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray


@dataclass(frozen=True, slots=True)
class DepthImage:
    """``depths`` (rows x columns, float32) along the optical axis, m; inf where nothing came back.

    ``points`` (n x 3, float32) are the same as x, y, z in base_link, z above the floor. ``mount`` and ``attitude`` say
    where the camera sits in base_link; ``width`` and ``height`` are its field of view in rad.
    """

    stamp: float
    depths: NDArray[np.float32]
    points: NDArray[np.float32]
    mount: Vector3
    attitude: Orientation
    width: float
    height: float


class DepthCamera(Component):
    """Takes an image when asked for one, at most ``rate`` a second."""

    rate: float
    connected: bool = True  # whether it answers; there is no image from one that doesn't

    @property
    @abstractmethod
    def image(self) -> DepthImage | None:
        """The newest of the camera ahead; None before the first, and while switched off or masked."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if it takes images."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch it."""
