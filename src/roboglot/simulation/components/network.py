"""Wi-Fi reception: log-distance path loss from the nearest access points, walls and slabs in between."""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.components.network import Network
from roboglot.model.geometry import Point
from roboglot.simulation.body import Network as NetworkSection
from roboglot.simulation.hull import Hull
from roboglot.simulation.radio import Radio

PERIOD = 1.0  # s between measurements
FLOOR_OF_NOISE = -95.0


class SimulatedNetwork(Network):
    """Measures once a second, as drivers do."""

    def __init__(self, section: NetworkSection, hull: Hull, radio: Radio, random: np.random.Generator) -> None:
        self._section, self._hull, self._radio, self._random = section, hull, radio, random
        self._signal = FLOOR_OF_NOISE
        self._next = -math.inf
        self.jammed = False  # whether it hears nothing at all
        self.sense(0.0)

    @property
    def signal(self) -> float:
        return self._signal

    def sense(self, stamp: float) -> None:
        """Measure if it is time."""
        if stamp < self._next:
            return
        self._next = stamp + PERIOD
        if self.jammed:
            self._signal = FLOOR_OF_NOISE
            return
        pose = self._hull.pose
        heard = self._radio.strength(Point(pose.x, pose.y), self._hull.floor)
        self._signal = max(FLOOR_OF_NOISE, heard + float(self._random.normal(0.0, self._section.noise)))
