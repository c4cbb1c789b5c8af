"""Latest values that a dog reported and the commands since, in the model's units."""

from __future__ import annotations

import math
from dataclasses import field
from typing import TYPE_CHECKING, Any

from roboglot.extras import lazy
from roboglot.model.geometry import ORIGIN, STILL, Path, Point, Pose, Twist
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, LaserScan, OdometryReading
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")

LAG = 0.15  # s time constant of a new velocity
STEP_MAX = 0.05  # s of one step of dead reckoning
FRAME_GOOD = 0.2  # s for which a dog walks on after a servo frame
RECKONED_MAX = 5.0  # s: the longest dead reckoning in one call


def _nothing() -> OccupancyGrid:
    return OccupancyGrid(np.zeros((0, 0), np.int8), 0.05, Point())


@dataclass(slots=True)
class ReportedState:
    """Dead-reckons from the last reported pose, at first from the origin."""

    pose: Pose = ORIGIN  # by reckoning, in the map once the dog is localized
    twist: Twist = STILL
    target: Twist = STILL
    frame_at: float = -math.inf  # when the dog took the last servo frame
    stamp: float = 0.0
    distance: float = 0.0
    pose_at: float = -math.inf
    battery: BatteryState = field(default_factory=lambda: BatteryState(0.0, 0.0, 0.0, 0.0, False, 0))
    battery_details: dict[str, Any] = field(default_factory=dict)  # polled fields of BatteryState
    docked: bool = False
    task_status: int = 0
    path: Path = field(default_factory=Path)
    scan: LaserScan | None = None
    grid: OccupancyGrid = field(default_factory=_nothing)
    revision: int = 0

    def advance_to(self, now: float) -> OdometryReading:
        """Dead-reckon until ``now`` (s) by the accepted servo frames; return the odometry; it stands without them."""
        left = min(max(now - self.stamp, 0.0), RECKONED_MAX)
        while left > 1e-9:
            step = min(left, STEP_MAX)
            share = 1.0 - math.exp(-step / LAG)
            walks = now - left < self.frame_at + FRAME_GOOD
            before, goal = self.twist, self.target if walks else STILL
            self.twist = Twist(
                before.x + (goal.x - before.x) * share,
                before.y + (goal.y - before.y) * share,
                before.yaw + (goal.yaw - before.yaw) * share,
            )
            self.pose = self.pose.compose(Pose(self.twist.x * step, self.twist.y * step, self.twist.yaw * step))
            self.distance += self.twist.speed * step
            left -= step
        self.stamp = now
        return OdometryReading(now, self.pose, self.twist, self.distance)

    def correct(self, pose: Pose, now: float) -> None:
        """Correct the pose by a report of the dog."""
        self.advance_to(now)
        self.pose, self.pose_at = pose, now
