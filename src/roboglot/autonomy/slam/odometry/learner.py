"""Learns a robot's odometry errors from corrections by matches, leaving out those with other causes."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.matcher import Match
from roboglot.autonomy.slam.odometry.noise import Doubt, LearntBias, LearntNoise, Rows
from roboglot.model.components.sensing.odometry import OdometryNoise
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.values import dataclass

LEARNS_AFTER = 1.0  # m after a contradiction before corrections are used for learning again


@dataclass(frozen=True, slots=True)
class Correction:
    """Correction by a match from ``before``, with ``prior`` covariance, to ``best``, after odometry's ``step``.

    ``moved``: the same step, made in ``seconds``; None if unusable for odometry's constant errors.
    """

    before: Pose
    best: Match
    prior: NDArray[np.float64]
    step: Pose
    moved: Pose | None
    seconds: float


class OdometryLearner:
    """Learner; ``noise``: random errors of odometry; ``bias``: its constant errors."""

    def __init__(self, described: OdometryNoise) -> None:
        self.noise, self.bias = LearntNoise(described), LearntBias()
        self._learns_from = 0.0  # m driven

    @property
    def kept(self) -> dict[str, float]:
        """Values to store for this robot's next start."""
        return self.noise.kept | self.bias.kept

    def restore(self, kept: Mapping[str, object]) -> None:
        """Continue from ``kept`` values."""
        self.noise.restore(kept)
        self.bias.restore(kept)

    def spread(
        self, covariance: NDArray[np.float64], way: float, turn: float, moved: Pose | None, seconds: float
    ) -> NDArray[np.float64]:
        """Return ``covariance`` (x, y, yaw) after ``way`` m and ``turn`` rad; ``moved`` in ``seconds``, if known."""
        return self.bias.spread(self.noise.spread(covariance, way, turn), moved or Pose(), seconds)

    def contradict(self, driven: float) -> None:
        """Note that the wheels contradicted a match at ``driven`` m, which suspends learning for a while."""
        self._learns_from = driven + LEARNS_AFTER

    def learns(self, driven: float) -> bool:
        """Return whether corrections are used for learning (again) after ``driven`` m."""
        return driven >= self._learns_from

    def learn(self, correction: Correction, driven: float, still: Callable[[], bool]) -> None:
        """Learn from a correction at ``driven`` m; the noise rises only if everything around is ``still``."""
        before, here, step = correction.before, correction.best.pose, correction.step
        prior: Rows = correction.prior.tolist()
        after: Rows = correction.best.covariance.tolist()
        off = (here.x - before.x, here.y - before.y, wrap_angle(here.yaw - before.yaw))
        direction = here.yaw - step.yaw + math.atan2(step.y, step.x)
        self.noise.learn(off, prior, after, direction, rising=lambda: self.learns(driven) and still())
        if correction.moved is None:
            return
        c, s = abs(math.cos(here.yaw)), abs(math.sin(here.yaw))
        seen_x, seen_y = 1.0 - after[0][0] / prior[0][0], 1.0 - after[1][1] / prior[1][1]
        seen = (c * seen_x + s * seen_y, s * seen_x + c * seen_y) if self.learns(driven) else (0.0, 0.0)
        newest = self.noise.newest
        doubt = Doubt(max(after[0][0], after[1][1]) + newest.way, after[2][2] + newest.yaw)
        self.bias.learn(correction.moved, correction.seconds, here.relative_to(before), seen, doubt)
