"""Time-of-flight sensors: small grids of distances."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.component import Component


@dataclass(frozen=True, slots=True)
class ZoneDistances:
    """One measurement: ``distances`` (m, 8 x 8 float32, row 0 on top, column 0 to the left as the sensor looks).

    -inf: nearer than ``range_min``, inf: nothing within ``range_max`` (ROS's REP-117). ``points`` (n x 3, float32) are
    those with a distance, as x, y, z in base_link, z above the floor it stands on.
    """

    stamp: float
    distances: NDArray[np.float32]
    range_min: float
    range_max: float
    points: NDArray[np.float32]


class TimeOfFlight(Component):
    """All such sensors of the robot by name; they measure only when somebody reads them, at most ``rate`` a second."""

    names: tuple[str, ...]
    rate: float

    @abstractmethod
    def reading(self, name: str) -> ZoneDistances:
        """The newest. Raises NotFound."""
