"""Events of mapping: the robot's pose, its scans, and changes of the map and its annotations."""

from __future__ import annotations

from collections.abc import Sequence
from enum import StrEnum
from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event
from roboglot.model.geometry import Pose
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.model.sensing import LaserScan


@dataclass(frozen=True, slots=True, kw_only=True)
class ScanTaken(Event):
    """The lidar finished a turn; ``odometry`` is where odometry puts base_link at that moment (odom frame)."""

    scan: LaserScan
    odometry: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseJumped(Event):
    """The robot's pose was set, or found to be elsewhere: the pose in the map changed without driving.

    ``given``: it was set by someone; ``PoseConfirmed`` or ``LocalizationLost`` says what the map makes of it.
    """

    pose: Pose
    given: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class PoseConfirmed(Event):
    """The scans fit the map at a pose that someone gave, or that was found after ``RobotDisplaced``."""

    pose: Pose


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotDisplaced(Event):
    """Something else than its own wheels or legs moved the robot, by ``distance`` m."""

    distance: float


class LostReason(StrEnum):
    """Reason why the robot lost its pose in the map."""

    NO_FIT = "the scans do not fit the map"
    NO_SCANS = "the lidar is silent"
    AMBIGUOUS = "several places look alike"
    NO_GROUND = "nothing around is in the map"


class RecoveryMeans(StrEnum):
    """Means by which the robot found its pose in the map again."""

    NEARBY = "found near where it was believed to be"
    WHOLE_MAP = "found in the whole map"
    JOINED = "the new part of the map was joined to the old one"
    GIVEN = "the pose was given"
    SCANS = "the lidar sends again"


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalizationLost(Event):
    """The robot no longer knows its place in the map; ``quality``: 0..1, of the last scans against the map."""

    reason: LostReason
    quality: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LocalizationRecovered(Event):
    """The robot knows its place again, after ``seconds`` without."""

    means: RecoveryMeans
    pose: Pose
    seconds: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MapReplaced(Event):
    """The map was cleared, loaded or started again; ``origin``: of the new map in the old one, if they are related."""

    origin: Pose | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorReached(Event):
    """The lift has brought the robot to another floor, counted from 0; its ride may have been given up.

    ``place``: of base_link in the frame of its place in the car, on the floor's map, which is in use. None: the robot
    was carried there, and its place on the floor is unknown.
    """

    floor: int
    place: Pose | None


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopClosed(Event):
    """The robot knew a place again after a long way and straightened the map; ``shift``: m its own place moved by.

    ``moved``: places all over the map, each where it was and where it is now.
    """

    shift: float
    moved: Sequence[tuple[Pose, Pose]] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacesChanged(Event):
    """Points of interest were added, changed or removed."""


@dataclass(frozen=True, slots=True, kw_only=True)
class AnnotationsChanged(Event):
    """Walls, tracks, areas, docks or landmarks of the map changed."""
