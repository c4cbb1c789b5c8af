"""One-way stretches: narrow parts of a robot's path that it does not enter while another comes through them.

Two that meet in the middle of a corridor lose more than one that waits at its end: one of them has to go back all the
way. The first one in goes first; of two that would come in at about the same time, the one by rule.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.route import SPACING
from roboglot.autonomy.traffic.right_of_way import CLEAR, SLOW, STEP, Meeting, Way

NEAR = 3.0  # m ahead within which a stretch may begin
OPPOSITE = -0.3  # cosine below which two drive against each other
LONG = 0.6  # m that they must, in it
TIE = 1.5  # s between two arrivals up to which the rule decides
SPARE = 1.0  # s that a robot must leave it before the other comes in
GIVEN_UP = 4.0  # s after which a robot that stands in it is ignored

Points = NDArray[np.float64]


class OneWayStretches:
    """Narrow stretches that must stay free, found with the times at which the others were last seen moving."""

    def __init__(self) -> None:
        self._moved: dict[str, float] = {}  # time at which each was last seen moving, s

    def observe(self, ways: Sequence[Way], stamp: float) -> None:
        """Take note of the others now."""
        moved = self._moved
        self._moved = {way.name: stamp if way.speed > 0.05 else moved.get(way.name, stamp) for way in ways if way.name}

    def meeting(
        self,
        path: Points,
        narrow: Callable[[], NDArray[np.bool_]],
        speed: float,
        radius: float,
        ways: Sequence[Way],
        stamp: float,
    ) -> Meeting | None:
        """Return the first stretch of ``path`` (dense) that must stay free for now.

        ``narrow`` finds where two cannot pass, and is called only if others come. The robot drives at ``speed`` m/s.
        """
        coming = [way for way in ways if len(way.points) >= 2 and stamp - self._moved.get(way.name, stamp) < GIVEN_UP]
        if not coming:
            return None
        tight = narrow()
        if not tight[: round(NEAR / SPACING) + 1].any():
            return None
        for begin, end in () if tight[0] else _stretches(tight):
            if begin * SPACING > NEAR:
                return None
            mine = path[begin : end : round(STEP / SPACING)]
            if len(mine) < 2:
                continue
            arrives, leaves = (at * SPACING / max(speed, SLOW) for at in (begin, end))
            for way in coming:
                if _goes_first(way, mine, radius, arrives, leaves):
                    stands = bool((way.distances(path[:1]) < radius + way.radius + CLEAR).any())
                    return Meeting(begin * SPACING, way, stands)
        return None


def _stretches(narrow: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index, exclusive, of each run."""
    edges = np.flatnonzero(np.diff(narrow.astype(np.int8), prepend=0, append=0))
    return [(begin, end) for begin, end in edges.reshape(-1, 2).tolist()]


def _goes_first(way: Way, mine: Points, radius: float, arrives: float, leaves: float) -> bool:
    """True if another one comes through ``mine``, the other way round, and before this robot.

    The robot would come in and out in so many seconds.
    """
    from roboglot.kernels.distance import facing  # it needs Numba

    reach = radius + way.radius + CLEAR
    against = facing(np.ascontiguousarray(mine), way.points, reach, OPPOSITE)
    if np.count_nonzero(against.any(axis=1)) * STEP < LONG:
        return False
    comes = float(way.seconds[(way.distances(mine) < reach).any(axis=0).argmax()])
    if comes == 0.0:
        return True  # it is inside
    if not way.name or leaves + SPARE < comes:
        return False
    return way.outranks if math.fabs(comes - arrives) < TIE else comes < arrives
