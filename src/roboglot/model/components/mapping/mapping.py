"""The map that the robot makes of what its lidar saw."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid


class Mapping(Component):
    """Begins with nothing at the pose where the robot woke up, which is the origin of map."""

    @property
    @abstractmethod
    def grid(self) -> OccupancyGrid:
        """The map so far, trimmed to what is known (0x0 when nothing is)."""

    @property
    @abstractmethod
    def revision(self) -> int:
        """Counts up whenever a cell changed."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """False: the map stays as it is."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Go on or stop adding scans."""

    @property
    @abstractmethod
    def closes_loops(self) -> bool:
        """True if a place known again after a long way straightens the map."""

    @abstractmethod
    def close_loops(self, on: bool) -> None:
        """Switch that. Each time it happens, ``LoopClosed`` is published, and ``PoseJumped``."""

    @abstractmethod
    def clear(self) -> None:
        """Forget the map; the robot's pose becomes the new origin. Publishes ``MapReplaced``."""

    @abstractmethod
    def load(self, grid: OccupancyGrid, pose: Pose) -> None:
        """Use ``grid`` from now on, with the robot at ``pose`` in it, or near enough to be found by the lidar.

        Its cells are resampled to this map's. InvalidGoal for what is too large. Publishes ``MapReplaced``.
        """

    @abstractmethod
    def move_origin(self, point: Point) -> Point:
        """Make ``point`` of the map its origin, to the nearest cell border, which is returned.

        InvalidGoal beyond 10 km. Publishes ``MapReplaced``.
        """
