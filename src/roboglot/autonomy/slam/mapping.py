"""The mapping component, from Lidar and Odometry. The estimator that fills the map is in slam.py."""

from __future__ import annotations

import math

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.autonomy.slam.grid_import import evidence_of
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import MapReplaced, PoseJumped, Rebooted
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot

ORIGIN_MAX = 10_000.0  # m from the origin to the new one


class LidarMapping(Mapping):
    """Mapping, empty until the estimator runs."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief
        robot.events.listen(Rebooted, lambda _: self._start_afresh())

    def _start_afresh(self) -> None:
        """Begin with an empty map, as at a start: the one in memory was lost."""
        self.clear()
        self.enable(True)
        self.close_loops(True)

    @property
    def grid(self) -> OccupancyGrid:
        return self._belief.map.occupancy()

    @property
    def revision(self) -> int:
        return self._belief.revision

    @property
    def enabled(self) -> bool:
        return self._belief.mapping

    def enable(self, on: bool) -> None:
        self._belief.mapping = on

    @property
    def closes_loops(self) -> bool:
        return self._belief.closing_loops

    def close_loops(self, on: bool) -> None:
        self._belief.closing_loops = on

    def clear(self) -> None:
        origin = self._belief.pose
        self._belief.forget_map()
        self._robot.events.publish(MapReplaced(stamp=self._robot.clock.time(), origin=origin))

    def load(self, grid: OccupancyGrid, pose: Pose, *, origin: Pose | None = None) -> None:
        if not all(map(math.isfinite, (pose.x, pose.y, pose.yaw))):
            raise InvalidGoal(f"not a place on this map: {pose}")
        self._belief.take_map(evidence_of(grid), pose)
        now = self._robot.clock.time()
        self._robot.events.publish(MapReplaced(stamp=now, origin=origin))
        self._robot.events.publish(PoseJumped(stamp=now, pose=pose, given=True))

    def move_origin(self, point: Point) -> Point:
        if not math.hypot(point.x, point.y) <= ORIGIN_MAX:
            raise InvalidGoal(f"not an origin of a map: {point}")
        column, row = round(point.x / RESOLUTION), round(point.y / RESOLUTION)
        origin = Pose(column * RESOLUTION, row * RESOLUTION)
        belief = self._belief
        belief.map, belief.frame = belief.map.seen_from(column, row), ""
        belief.map_to_odom = belief.map_to_odom.relative_to(origin)
        belief.revision += 1
        self._robot.events.publish(MapReplaced(stamp=self._robot.clock.time(), origin=origin))
        return origin.point
