"""Poses of all scans relative to keyframes, so that correcting the map corrects the whole path."""

from __future__ import annotations

import math
from array import array
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import Belief
from roboglot.model.geometry import Pose
from roboglot.values import dataclass

STEPS_MAX = 500_000  # scans; beyond this the older half is dropped
STANDING_PERIOD = 10.0  # s between two steps while standing
FIELDS = 11  # stamp, keyframe, x, y, yaw, and the covariance's upper triangle


@dataclass(frozen=True, slots=True)
class TrajectoryPoint:
    """Pose of base_link in map at ``stamp``; ``covariance`` (3, 3) of x, y, yaw; ``keyframe``: its scan is kept."""

    stamp: float
    pose: Pose
    covariance: NDArray[np.float64]
    keyframe: bool


class Trajectory:
    """Trajectory of ``belief``, a step for every matched scan; ``newest``: stamp of the last one (s)."""

    def __init__(self, belief: Belief) -> None:
        self._belief, self._map = belief, belief.map
        self._steps = array("d")
        self.newest = -math.inf

    def clear(self) -> None:
        """Forget all steps, for another map."""
        self._steps, self.newest = array("d"), -math.inf

    def follow(self, stamp: float, odometry: Pose, anchor: tuple[int, Pose] | None, *, drives: bool) -> None:
        """Add the believed pose, seldom while standing; another map begins another trajectory."""
        belief = self._belief
        if self._map is not belief.map:
            self._map = belief.map
            self.clear()
        if drives or stamp - self.newest >= STANDING_PERIOD:
            self.add(stamp, belief.map_to_odom.compose(odometry), belief.doubt, anchor)

    def add(self, stamp: float, pose: Pose, covariance: NDArray[np.float64], anchor: tuple[int, Pose] | None) -> None:
        """Add a step; ``anchor``: number and pose of the keyframe that moves it; None: it stays."""
        self.newest = stamp
        number, origin = anchor or (-1, Pose())
        local = pose.relative_to(origin)
        (xx, xy, xw), (_, yy, yw), (_, _, ww) = covariance.tolist()
        self._steps.extend((stamp, number, local.x, local.y, local.yaw, xx, xy, xw, yy, yw, ww))
        if len(self._steps) > STEPS_MAX * FIELDS:
            del self._steps[: len(self._steps) // FIELDS // 2 * FIELDS]

    def points(self, keyframes: Sequence[Pose]) -> list[TrajectoryPoint]:
        """Return all steps (map), by the present poses of the keyframes."""
        result, seen = [], set()
        for row in np.frombuffer(self._steps, np.float64).reshape(-1, FIELDS).tolist():
            stamp, number, x, y, yaw, *upper = row
            k = int(number)
            pose = Pose(x, y, yaw) if k < 0 else keyframes[k].compose(Pose(x, y, yaw))
            covariance = np.empty((3, 3))
            covariance[np.triu_indices(3)] = upper
            covariance[np.tril_indices(3)] = covariance.T[np.tril_indices(3)]
            result.append(TrajectoryPoint(stamp, pose, covariance, k >= 0 and k not in seen))
            seen.add(k)
        return result
