"""Localization: the pose of the robot in its map."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.events import LostReason
from roboglot.model.geometry import Pose, written
from roboglot.values import dataclass

GOOD_FIT = 0.5  # quality from which the pose counts as known
LOCALIZATION = "localization"  # the resource held while searching for the robot's pose


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of the map, m."""

    min_x: float
    min_y: float
    max_x: float
    max_y: float

    def __str__(self) -> str:
        return f"{written(self.min_x, self.min_y)} to {written(self.max_x, self.max_y)}"


class Localization(Component):
    """Corrects odometry by lidar scans; publishes ``PoseJumped`` when the pose is set or corrected by a jump.

    ``LocalizationLost`` and ``LocalizationRecovered`` report the loss and the recovery of the pose.
    """

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """Current pose of base_link in map."""

    @property
    @abstractmethod
    def quality(self) -> float:
        """Fit of the last scans to the map, 0..1; less where they leave the place open, as along a bare corridor."""

    @property
    def deviation(self) -> float | None:
        """Standard deviation of the position in its worst direction, m; None: unknown."""
        return None

    @property
    def started(self) -> bool:
        """False until the first scan has been matched; ``quality`` is meaningless before that."""
        return True

    @property
    def lost(self) -> LostReason | None:
        """Reason why the robot has lost its pose in the map; None while localized."""
        return None

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if scans correct the pose; False: it follows odometry alone."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch the correction by the lidar."""

    @abstractmethod
    def set_pose(self, pose: Pose) -> None:
        """Set the robot's pose in the map."""

    @abstractmethod
    def relocalize(self, region: Region | None = None, *, may_move: bool = False, source: str = "") -> Action:
        """Search for the robot by lidar, anywhere in the map or with its centre in ``region``.

        The robot stands still, unless ``may_move`` lets it drive to tell similar places apart. Aborts with NotLocalized
        when no place, or more than one, fits within some seconds; with NotReady when a search is not possible yet.
        Raises InvalidGoal for an empty region.
        """
