"""Feeds an estimator from a recording instead of a robot: odometry and lidar components with recorded readings."""

from __future__ import annotations

from roboglot.datasets.drive_log import RecordedScan
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import EventStream, ScanTaken
from roboglot.model.geometry import ORIGIN, STILL, Pose, Twist
from roboglot.model.sensing import LaserScan, OdometryReading

GAP_MAX = 0.5  # s between two scans up to which a speed is computed


class ReplayedOdometry(Odometry):
    """Odometry of the last played scan, with the drive's first pose as origin."""

    def __init__(self) -> None:
        self._reading = OdometryReading(0.0, ORIGIN, STILL, 0.0)

    @property
    def reading(self) -> OdometryReading:
        return self._reading

    def take(self, stamp: float, pose: Pose) -> None:
        """Set the next recorded pose; ``stamp`` in s."""
        before = self._reading
        seconds, moved = stamp - before.stamp, pose.relative_to(before.pose)
        twist = STILL
        if 0.0 < seconds < GAP_MAX:
            twist = Twist(moved.x / seconds, moved.y / seconds, moved.yaw / seconds)
        self._reading = OdometryReading(stamp, pose, twist, before.distance + pose.distance_to(before.pose))


class ReplayedLidar(Lidar):
    """The last played scan."""

    rate = 0.0

    def __init__(self) -> None:
        self._scan: LaserScan | None = None

    @property
    def scan(self) -> LaserScan | None:
        return self._scan

    def take(self, scan: LaserScan) -> None:
        """Set the next recorded scan."""
        self._scan = scan


class Replay:
    """Plays scans to the listeners of ``events``; the drive's first odometry pose becomes the origin of odom."""

    def __init__(self, events: EventStream) -> None:
        self.odometry, self.lidar = ReplayedOdometry(), ReplayedLidar()
        self._events = events
        self._origin: Pose | None = None

    def play(self, recorded: RecordedScan) -> Pose:
        """Publish one scan; return the odometry pose (odom) at its time."""
        if self._origin is None:
            self._origin = recorded.odometry
        pose = recorded.odometry.relative_to(self._origin)
        self.odometry.take(recorded.scan.stamp, pose)
        self.lidar.take(recorded.scan)
        self._events.publish(ScanTaken(stamp=recorded.scan.stamp, scan=recorded.scan, odometry=pose))
        return pose
