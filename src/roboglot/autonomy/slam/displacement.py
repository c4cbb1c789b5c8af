"""Detects motion of the robot by anything but its wheels, from the scans' poses against odometry's.

Odometry's own errors grow with the distance and are in the prior of each match; a shove is larger, and sudden.
"""

from __future__ import annotations

import math
from collections import deque

import numpy as np
from numpy.typing import NDArray

from roboglot.model.geometry import Pose

WINDOW = 1.0  # s that a displacement takes
SHOVED, SHOVED_PER_METRE = 0.05, 0.05  # m, and m per m driven, of odometry error beyond which the robot was displaced
SIGMAS = 3.0  # standard deviations of the prior that explain a correction
QUIET = 1.0  # s after a pose was set in which corrections are ignored


class DisplacementWatch:
    """Watch over the corrections of all trusted matches."""

    def __init__(self) -> None:
        # stamp; x, y in map; m driven; m, the prior's standard deviation
        self._corrections: deque[tuple[float, float, float, float, float]] = deque()
        self._quiet_until = -math.inf

    def forget(self, stamp: float) -> None:
        """Forget past corrections, and ignore the next ones: the pose was set, or is in doubt."""
        self._corrections.clear()
        self._quiet_until = stamp + QUIET

    def check(self, stamp: float, before: Pose, seen: Pose, prior: NDArray[np.float64], way: float) -> float | None:
        """Return a recent displacement (m), once; None: there was none.

        ``before``: pose by odometry, ``seen``: by the scan (map); ``prior``: covariance before the match; ``way``: m
        driven since the last one.
        """
        if stamp < self._quiet_until:
            return None
        corrections = self._corrections
        while corrections and stamp - corrections[0][0] > WINDOW:
            corrections.popleft()
        sigma = math.sqrt(float(prior[0, 0] + prior[1, 1]))
        corrections.append((stamp, seen.x - before.x, seen.y - before.y, way, sigma))
        x = y = driven = widest = 0.0
        for _, along, up, some, sigma in corrections:
            x, y, driven, widest = x + along, y + up, driven + some, max(widest, sigma)
        shoved = math.hypot(x, y)
        if shoved <= SHOVED + SHOVED_PER_METRE * driven + SIGMAS * widest:
            return None
        self.forget(stamp)
        return shoved
