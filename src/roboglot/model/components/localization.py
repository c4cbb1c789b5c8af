"""Where the robot is in its map."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.geometry import Pose


class Localization(Component):
    """Corrects odometry by what the lidar sees; publishes ``PoseJumped`` when told or found elsewhere."""

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """base_link in map, now."""

    @property
    @abstractmethod
    def quality(self) -> float:
        """0..1: how well the last scans fit the map."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """False: the pose follows odometry alone."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch the correction by the lidar."""

    @abstractmethod
    def set_pose(self, pose: Pose) -> None:
        """Somebody who knows says: the robot is at ``pose`` in the map."""
