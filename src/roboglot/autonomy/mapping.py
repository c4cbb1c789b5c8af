"""Mapping from Lidar and Odometry: the component. The estimator that fills the map is slam.py's."""

from __future__ import annotations

from roboglot.autonomy.belief import Belief
from roboglot.model.components.mapping import Mapping
from roboglot.model.events import MapReplaced
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot


class LidarMapping(Mapping):
    """Empty until the estimator runs."""

    def __init__(self, robot: Robot, belief: Belief) -> None:
        self._robot = robot
        self._belief = belief

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

    def clear(self) -> None:
        origin = self._belief.pose
        self._belief.start_anew()
        self._robot.events.publish(MapReplaced(stamp=self._robot.clock.time(), origin=origin))
