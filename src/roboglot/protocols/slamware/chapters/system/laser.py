"""The latest laser scan in the robot's frame, encoded once for all requests."""

from __future__ import annotations

from collections.abc import Callable

import msgspec
import numpy as np

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.model.sensing import LaserScan
from roboglot.wire.slamware.chapters.system.system import LaserPoint

_NONE_YET = msgspec.Raw(b"[]")


class Laser:
    """Last scan with the robot's odometry at its time."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: ScanTaken | None = None
        self._encoded: tuple[ScanTaken, msgspec.Raw] | None = None
        self._end: Callable[[], None] = lambda: None

    def start(self) -> None:
        """Start listening to the lidar."""
        self._end = self._robot.events.listen(ScanTaken, self._taken)

    def close(self) -> None:
        """Stop listening."""
        self._end()

    @property
    def running(self) -> bool:
        """True once the lidar has sent a scan."""
        return self._last is not None

    @property
    def pose(self) -> Pose:
        """Pose of the robot in the map at the time of the scan: its current pose, corrected by odometry."""
        pose = self._robot[Localization].pose
        if self._last is None:
            return pose
        return pose.compose(self._last.odometry.relative_to(self._robot[Odometry].reading.pose))

    @property
    def points(self) -> msgspec.Raw:
        """Return the scan as a JSON array of LaserPoints; empty before the first scan."""
        if (last := self._last) is None:
            return _NONE_YET
        if self._encoded is None or self._encoded[0] is not last:
            self._encoded = (last, msgspec.Raw(msgspec.json.encode(laser_points(last.scan))))
        return self._encoded[1]

    def _taken(self, event: ScanTaken) -> None:
        self._last = event


def laser_points(scan: LaserScan) -> list[LaserPoint]:
    """Return ``scan`` from base_link; points without a return are kept, as (0, angle, not valid)."""
    ranges = scan.ranges.astype(np.float64)
    valid = np.isfinite(ranges) & (ranges >= scan.range_min) & (ranges <= scan.range_max)
    distances, angles = np.where(valid, ranges, 0.0), scan.angles + scan.mount.yaw
    if scan.mount.x or scan.mount.y:
        x, y = scan.mount.x + distances * np.cos(angles), scan.mount.y + distances * np.sin(angles)
        distances, angles = np.where(valid, np.hypot(x, y), 0.0), np.where(valid, np.arctan2(y, x), angles)
    angles = np.remainder(angles + np.pi, 2 * np.pi) - np.pi
    columns = zip(distances.round(4).tolist(), angles.round(6).tolist(), valid.tolist(), strict=True)
    return [LaserPoint(*column) for column in columns]
