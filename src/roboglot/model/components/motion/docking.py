"""Docking at the charging station."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.geometry import Pose

BEFORE_DOCK = 0.6  # m from the docked pose to the place in front of the dock from which the robot backs up


class Docking(Component):
    """Made of Navigation, Driving, Lidar and DockContact."""

    @property
    @abstractmethod
    def home(self) -> Pose | None:
        """Pose of base_link in map when docked; None if no dock is known."""

    @abstractmethod
    def set_home(self, pose: Pose | None) -> None:
        """Set the docked pose of base_link in map; None deletes it."""

    @abstractmethod
    def dock(self, *, source: str = "") -> Action:
        """Drive to the dock and onto its contacts; aborts with DockNotFound and navigation's errors.

        A dock at an unknown place is searched nearby. Feedback: "searching" in that case, "approaching", "docking",
        "docked".
        """

    @abstractmethod
    def undock(self, *, source: str = "") -> Action:
        """Leave the dock straight ahead until there is room to turn; succeeds at once off the dock.

        Aborts with Blocked when something holds the robot. Feedback: "leaving".
        """
