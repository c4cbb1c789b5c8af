"""On which terms a route is planned. Loads no kernels."""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.motion.navigation import Tracks


@dataclass(frozen=True, slots=True, kw_only=True)
class Terms:
    """How to plan: the time, the robot's limits (m/s, m/s2), how near a goal counts (m), and what is heeded.

    ``obstacles`` False: the map, and what is ``drawn`` on it, alone. ``things`` False as well: what stands alone on the
    map does not count either. It may be a person whom a robot that woke up beside them took for a pillar.
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
