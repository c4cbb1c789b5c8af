"""The map that the robot builds from lidar scans."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.action import Action, ActionStatus
from roboglot.model.components.component import Component
from roboglot.model.errors import Unreachable
from roboglot.model.events import ActionChanged, MapReplaced
from roboglot.model.geometry import ORIGIN, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot


class Mapping(Component):
    """Starts empty; the pose at power-on is the origin of map."""

    @property
    @abstractmethod
    def grid(self) -> OccupancyGrid:
        """The map so far, trimmed to what is known (0x0 when nothing is)."""

    @property
    @abstractmethod
    def revision(self) -> int:
        """Number that increases whenever a cell changes."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """True if scans update the map."""

    @abstractmethod
    def enable(self, on: bool) -> None:
        """Switch the updates by scans on or off."""

    @property
    @abstractmethod
    def closes_loops(self) -> bool:
        """True if recognising a place after a long way corrects the map."""

    @abstractmethod
    def close_loops(self, on: bool) -> None:
        """Switch loop closing. Each closed loop publishes ``LoopClosed`` and ``PoseJumped``."""

    @abstractmethod
    def clear(self) -> None:
        """Delete the map; the robot's pose becomes the new origin. Publishes ``MapReplaced``."""

    @abstractmethod
    def load(self, grid: OccupancyGrid, pose: Pose, *, origin: Pose | None = None) -> None:
        """Replace the map by ``grid``, with the robot at ``pose``, or near enough for the lidar to correct it.

        ``origin``: of the new map in the old one, if they are related. Its cells are resampled to this map's. Raises
        InvalidGoal if it is too large. Publishes ``MapReplaced``.
        """

    @abstractmethod
    def move_origin(self, point: Point) -> Point:
        """Move the origin to ``point``, rounded to a cell border; return the rounded point.

        InvalidGoal beyond 10 km. Publishes ``MapReplaced``.
        """


def abort_with_map(robot: Robot, action: Action, until: ActionStatus = ActionStatus.SUCCEEDED) -> Action:
    """Abort ``action``, whose goal is a place on the present map, if that is replaced: there, the goal is elsewhere.

    From now on, as it may wait for another to brake, ``until`` it has this status or has ended. Returns the action.
    """

    def check_map(event: MapReplaced) -> None:
        if event.origin != ORIGIN:
            action.abort(Unreachable("the map was replaced, and with it the goal's place"))

    def check_end(event: ActionChanged) -> None:
        if event.action is action and (action.status.ended or action.status is until):
            for leave in leaves:
                leave()

    leaves = [robot.events.listen(MapReplaced, check_map), robot.events.listen(ActionChanged, check_end)]
    return action
