"""Time-of-flight sensors: small grids of distances."""

from __future__ import annotations

from abc import abstractmethod
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.components.component import Component
from roboglot.model.geometry import Vector3
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


@dataclass(frozen=True, slots=True)
class ZoneDistances:
    """One measurement: ``distances`` (m, 8 x 8 float32, row 0 on top, column 0 to the left as the sensor looks).

    -inf: nearer than ``range_min``, inf: nothing within ``range_max`` (ROS's REP-117). ``rays`` (64 x 3, float32, row
    by row, of length 1) are the directions in which the zones looked from ``eye`` (m), both in base_link.
    """

    stamp: float
    distances: NDArray[np.float32]
    range_min: float
    range_max: float
    rays: NDArray[np.float32]
    eye: Vector3

    @property
    def points(self) -> NDArray[np.float32]:
        """Points with a distance (n, 3): x, y, z in base_link, m, z above the floor it stands on."""
        ways = self.distances.ravel()
        seen = np.isfinite(ways)
        return (self.rays[seen] * ways[seen, None] + (self.eye.x, self.eye.y, self.eye.z)).astype(np.float32)


class TimeOfFlight(Component):
    """Time-of-flight sensors of the robot, by name; they measure only when read, at most ``rate`` times per second."""

    names: tuple[str, ...]
    rate: float

    @property
    def readings(self) -> list[ZoneDistances]:
        """The latest measurements of all, in the order of ``names``."""
        return [self.reading(name) for name in self.names]

    @abstractmethod
    def reading(self, name: str) -> ZoneDistances:
        """Return the latest measurement. Raises NotFound."""
