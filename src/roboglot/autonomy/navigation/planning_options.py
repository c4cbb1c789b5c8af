"""Options of a plan. Loads no kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.motion.navigation import Tracks
from roboglot.values import dataclass

KeepClear = Sequence[tuple[NDArray[np.float64], float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanningOptions:
    """Options of a plan: time (s), the robot's limits (m/s, m/s2), the goal's tolerance (m), and obstacles to consider.

    ``obstacles`` False: only the map and the annotations ``drawn`` on it count. ``things`` False as well: single things
    on the map do not count either, as one may be a person mapped as a pillar. ``keep_clear``: points (n, 2; map) where
    others are about to drive, and the distance (m) to keep from them.
    """

    now: float
    top: float
    acceleration: float
    tolerance: float
    drawn: Annotations
    tracks: Tracks = Tracks.FREE
    obstacles: bool = True
    things: bool = True
    straight: bool = False
    keep_clear: KeepClear = ()
