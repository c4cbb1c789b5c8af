"""Swept share of the lanes, measured by the robot's path, not by goals."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from types import TracebackType
from typing import Self

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.navigation.sweeping.lanes import STRETCH_MIN, Stretch
from roboglot.autonomy.slam.belief import Belief
from roboglot.model.actions import Action
from roboglot.model.components.motion.sweeping import SweepFeedback
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot

BESIDE = 0.08  # m from a lane within which the robot counts as driving along it
SPACING = 0.05  # m between the places of a lane that are checked
STEP_MAX = 0.3  # m between two scans; a larger step is a correction of the estimated pose
REPORTS = 100  # progress reports per drive, at most


class Swept:
    """A context that tracks the robot's path and reports the ``SweepFeedback`` of ``action``."""

    def __init__(self, robot: Robot, belief: Belief, action: Action, lanes: Sequence[Stretch]) -> None:
        self._robot, self._belief, self._action = robot, belief, action
        counts = [max(2, round(lane.length / SPACING) + 1) for lane in lanes]
        self._places = np.concatenate([_spread(lane, count) for lane, count in zip(lanes, counts, strict=True)])
        self._metres = np.concatenate(
            [np.full(count, lane.length / count) for lane, count in zip(lanes, counts, strict=True)]
        )
        self._ends = [0, *np.cumsum(counts).tolist()]
        self._swept = np.zeros(len(self._places), bool)
        self._last: Pose | None = None
        self._total = float(self._metres.sum())
        self._reported = 0.0

    def __enter__(self) -> Self:
        self._stop = self._robot.events.listen(ScanTaken, self._look)
        self.report()
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        self._stop()

    @property
    def done(self) -> float:
        """Length of the swept lanes, m."""
        return float(self._metres[self._swept].sum())

    def left(self) -> list[Stretch]:
        """Return the stretches not swept yet, without very short ones."""
        found: list[Stretch] = []
        for begin, end in pairwise(self._ends):
            edges = np.flatnonzero(np.diff(np.concatenate([[True], self._swept[begin:end], [True]])))
            for first, behind in edges.reshape(-1, 2).tolist():
                a, b = self._places[[begin + first, begin + behind - 1]].tolist()
                found.append(Stretch(Point(*a), Point(*b)))
        return [stretch for stretch in found if stretch.length >= STRETCH_MIN]

    def report(self, *, final: bool = False) -> None:
        """Report the progress; ``final``: with the length that was left out."""
        left_out = sum((stretch.length for stretch in self.left()), 0.0) if final else 0.0
        self._reported = self.done
        # Remnants at the ends of lanes are neither driven nor reported.
        done = self._total - left_out if final else self._reported
        self._action.report(SweepFeedback(done, self._total, left_out))

    def _look(self, _: ScanTaken) -> None:
        here, last = self._belief.pose, self._last
        self._last = here
        if last is None or last.distance_to(here) > STEP_MAX:
            last = here
        around = np.abs(self._places - (here.x, here.y)).max(axis=1) <= STEP_MAX + BESIDE
        near = np.flatnonzero(around & ~self._swept)
        if len(near):
            self._swept[near[_beside(self._places[near], last, here) <= BESIDE]] = True
        if self.done - self._reported > self._total / REPORTS:
            self.report()


def _spread(lane: Stretch, count: int) -> NDArray[np.float64]:
    """Return ``count`` places from end to end (count, 2; map, m)."""
    return np.linspace((lane.start.x, lane.start.y), (lane.end.x, lane.end.y), count)


def _beside(places: NDArray[np.float64], start: Pose, end: Pose) -> NDArray[np.float64]:
    """Return the distances from ``places`` (n, 2) to the line from ``start`` to ``end``, m."""
    way = np.array([end.x - start.x, end.y - start.y])
    offsets = places - (start.x, start.y)
    share = np.clip(offsets @ way / max(float(way @ way), 1e-12), 0.0, 1.0)
    away: NDArray[np.float64] = np.hypot(*(offsets - share[:, None] * way).T)
    return away
