"""Localization: the robot's pose in its map."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.component import Component
from roboglot.model.events import LostReason
from roboglot.model.geometry import Pose

LOCALIZATION = "localization"  # the resource held while searching for the robot's pose


@dataclass(frozen=True, slots=True)
class Region:
    """A rectangle of the map, m."""

    min_x: float
    min_y: float
    max_x: float
    max_y: float


class Localization(Component):
    """Corrects odometry by what the lidar sees; publishes ``PoseJumped`` when the pose is set or found elsewhere.

    ``LocalizationLost`` and ``LocalizationRecovered`` report when it loses its place and knows it again.
    """

    @property
    @abstractmethod
    def pose(self) -> Pose:
        """base_link in map, now."""

    @property
    @abstractmethod
    def quality(self) -> float:
        """0..1: how well the last scans fit the map."""

    @property
    def started(self) -> bool:
        """False while the first scan is still to be compared with the map: ``quality`` says nothing yet."""
        return True

    @property
    def lost(self) -> LostReason | None:
        """Reason why the robot has lost its pose in the map; None while localized."""
        return None

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """False: the pose follows odometry alone."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch the correction by the lidar."""

    @abstractmethod
    def set_pose(self, pose: Pose) -> None:
        """Set the robot's pose in the map."""

    @abstractmethod
    def relocalize(
        self,
        region: Region | None = None,
        *,
        may_move: bool = False,
        source: str = "",
        on_busy: OnBusy = OnBusy.REPLACE,
    ) -> Action:
        """Find the robot anywhere in the map, or with its centre in ``region``, by what the lidar sees.

        It stays put unless it ``may_move``: then it may drive around to tell places that look alike from each other.
        Aborts with NotLocalized when no place, or more than one, fits within some seconds; with NotReady when it cannot
        be tried yet. InvalidGoal for an empty region.
        """
