"""Terms on which a route is planned. Loads no kernels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.motion.navigation import Tracks
from roboglot.values import dataclass

Shunned = Sequence[tuple[NDArray[np.float64], float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """Terms of a plan: time (s), the robot's limits (m/s, m/s2), the goal's tolerance (m), and obstacles to consider.

    ``obstacles`` False: only the map and the annotations ``drawn`` on it count. ``things`` False as well: single things
    on the map do not count either, as one may be a person mapped as a pillar. ``shunned``: points (n, 2; map) and the
    distance (m) to keep from them, where others are about to drive.
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
    shunned: Shunned = ()
