"""The forward camera and its pictures."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal
from roboglot.model.feed import Viewer
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")

EXPOSURE_MAX = 3.0  # stops, up and down


def check_exposure(stops: float) -> None:
    """Raise InvalidGoal beyond EXPOSURE_MAX."""
    if not abs(stops) <= EXPOSURE_MAX:
        raise InvalidGoal(f"exposure is corrected by up to {EXPOSURE_MAX:g} stops, not {stops:g}")


@dataclass(frozen=True, slots=True)
class Frame:
    """One picture as YUV 4:2:0 (BT.601, limited range): ``planes`` is Y, then U, then V, (3/2 height, width), uint8.

    Read only: one picture serves all viewers. ``stamp``: robot time of the instant that it shows, s.
    """

    stamp: float
    planes: NDArray[np.uint8]

    @property
    def width(self) -> int:
        """Width, pixels."""
        return int(self.planes.shape[1])

    @property
    def height(self) -> int:
        """Height, pixels."""
        return int(self.planes.shape[0]) * 2 // 3

    @property
    def luma(self) -> NDArray[np.uint8]:
        """Brightness (height, width), 16 black to 235 white."""
        return self.planes[: self.height]

    @property
    def chroma(self) -> NDArray[np.uint8]:
        """U and V (2, height / 2, width / 2), 128 is grey."""
        return self.planes[self.height :].reshape(2, self.height // 2, self.width // 2)

    def rgb(self) -> NDArray[np.uint8]:
        """Return the picture as RGB (height, width, 3), 0..255."""
        luma = (self.luma.astype(np.float32) - 16.0) * np.float32(255 / 219)
        u, v = (self.chroma.astype(np.float32) - 128.0).repeat(2, 1).repeat(2, 2) * np.float32(255 / 224)
        pixels = np.stack((luma + 1.402 * v, luma - 0.344136 * u - 0.714136 * v, luma + 1.772 * u), axis=-1)
        return np.clip(pixels + 0.5, 0.0, 255.0).astype(np.uint8)


@dataclass(frozen=True, slots=True)
class Mount:
    """Position of a camera in base_link, m, and its direction, rad: pitch positive nose down."""

    x: float
    y: float
    z: float
    pitch: float = 0.0
    yaw: float = 0.0


class Camera(Component):
    """Works only while it has viewers. A pinhole without distortion; ``fov``: the whole horizontal angle, rad."""

    width: int
    height: int
    rate: float  # pictures per second for subscribers
    fov: float

    @property
    @abstractmethod
    def mount(self) -> Mount:
        """Current mount; legs and gimbals move it."""

    @property
    @abstractmethod
    def exposure(self) -> float:
        """Correction in stops: 0 normal, +1 twice as bright."""

    @abstractmethod
    def set_exposure(self, stops: float) -> None:
        """Correct the brightness. Raises InvalidGoal beyond EXPOSURE_MAX."""

    @property
    def delay(self) -> str:
        """Reason why the first picture takes long at present, a sentence; empty otherwise."""
        return ""

    def prepare(self) -> None:
        """Start the slow preparations of a first picture in the background; return at once."""

    @abstractmethod
    async def capture(self) -> Frame:
        """Take a picture now."""

    @abstractmethod
    def subscribe(self) -> Viewer[Frame]:
        """Return a viewer of pictures at ``rate``; all viewers share them."""
