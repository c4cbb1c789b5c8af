"""Narrow places on the robot's map, along a path or one by one. Their finder is loaded at the first use."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.route import SPACING
from roboglot.autonomy.slam.belief import Belief
from roboglot.model.clock import Clock
from roboglot.model.geometry import Point

if TYPE_CHECKING:
    from roboglot.autonomy.traffic.narrow_finder import NarrowFinder  # it needs the kernels

BETWEEN = 2.0  # m between two narrow places of a way that count as one: a robot that waits there is in the way

Points = NDArray[np.float64]


class NarrowPlaces:
    """Places on the believed map where two robots cannot pass each other."""

    def __init__(self, clock: Clock, belief: Belief) -> None:
        self._clock, self._belief = clock, belief
        self._loaded: NarrowFinder | None = None

    def along(self, path: Points, spacing: float = SPACING, *, skipped: int = 0) -> NDArray[np.bool_]:
        """Return which points of ``path``, ``spacing`` m apart, are too narrow for two, or between two such places.

        The first point is the robot's; the first ``skipped`` ones do not belong to the path.
        """
        from roboglot.kernels.distance import join  # it needs Numba

        narrow = self._finder().at(self._belief.map, path, self._clock.time())[skipped:]
        join(narrow, round(BETWEEN / spacing))
        return narrow

    def contains(self, here: Point, place: Point) -> bool:
        """True if ``place`` itself is too narrow for two; the robot is ``here``."""
        return self._finder().contains(self._belief.map, here, place, self._clock.time())

    def _finder(self) -> NarrowFinder:
        if self._loaded is None:
            from roboglot.autonomy.traffic.narrow_finder import NarrowFinder

            self._loaded = NarrowFinder()
        return self._loaded
