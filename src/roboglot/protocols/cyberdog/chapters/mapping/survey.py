"""Data about a map being made, besides its cells. Knows no task and no message."""

from __future__ import annotations

from collections import deque

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.sensing.gps import Gps, GpsFix, GpsReading
from roboglot.model.geodesy import GlobeAnchor, anchor
from roboglot.model.geometry import Point
from roboglot.model.robot import Robot

SAMPLES_MAX = 1800


class Survey:
    """Kind of a map being built, and satellite fixes on the way."""

    def __init__(self, outdoor: bool = False) -> None:
        self.replaced = False  # by another client's map
        self.outdoor = outdoor
        self._samples: deque[tuple[Point, GpsReading]] = deque(maxlen=SAMPLES_MAX)

    def look(self, robot: Robot) -> None:
        """Record the pose of the latest fix; indoors nothing."""
        if self.outdoor and Gps in robot and (fix := robot[Gps].reading).fix is not GpsFix.NONE:
            self._samples.append((robot[Localization].pose.point, fix))

    @property
    def anchor(self) -> GlobeAnchor | None:
        """Anchor of the map on the globe; None without satellites."""
        return anchor(self._samples)
