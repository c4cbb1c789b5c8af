"""Chapter "multi-floor": elevators on the map, and the robot's place relative to them.

An elevator area's centre line runs from the front door to the rear one; the manual does not say which end is which.
"""

from __future__ import annotations

import math
from dataclasses import replace
from enum import StrEnum

import msgspec

from roboglot.model.components.mapping.annotations import Annotations, Area, AreaKind, MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import pose3d
from roboglot.values import dataclass
from roboglot.wire.slamware.chapters.artifact import LENGTH_MAX, Identifier, MetadataError, number
from roboglot.wire.slamware.chapters.multi_floor import PoseRelation
from roboglot.wire.slamware.geometry import Pose3D

API = "/api/multi-floor/map/v1/elevators"
SILL, WAITING = 0.4, 1.0  # m, unless the metadata give them
WALL_GAP = 0.1  # m between the car's wall and a robot deep inside


class DoorType(StrEnum):
    """Doors of an elevator car."""

    FRONT = "front_door"
    REAR = "rear_door"
    BOTH = "double_doors"


DOORS = {"": DoorType.FRONT, "0": DoorType.FRONT, "1": DoorType.REAR, "2": DoorType.BOTH}


class ElevatorInfo(msgspec.Struct):
    """An elevator and its waiting places."""

    door_type: DoorType
    elevator_id: str
    front_scheduling_poses: list[Pose3D]
    rear_scheduling_poses: list[Pose3D]


@dataclass(frozen=True, slots=True)
class Elevator:
    """An area of the map as an elevator; ``sill`` and ``distance`` (of the waiting place from the door) in m."""

    id: str
    area: Area
    doors: DoorType
    sill: float
    distance: float

    @property
    def inward(self) -> float:
        """Direction from the front door into the car, rad in the map."""
        return self.area.start.bearing_to(self.area.end)

    @property
    def inside(self) -> Pose:
        """Pose in the middle of the car, facing away from the front door."""
        a, b = self.area.start, self.area.end
        return Pose((a.x + b.x) / 2, (a.y + b.y) / 2, self.inward)

    @property
    def aboard(self) -> Pose:
        """Pose in the middle of the car after a ride's way in: facing away from the front door, or the only one."""
        middle = self.inside
        return middle.compose(Pose(yaw=math.pi)) if self.doors is DoorType.REAR else middle

    def deep(self, radius: float, *, rear: bool) -> Point:
        """Return the innermost place for a hull of ``radius`` (m) that came in by a door: at least the middle."""
        depth = max(0.0, self.area.start.distance_to(self.area.end) / 2 - radius - WALL_GAP)
        return self.inside.compose(Pose(-depth if rear else depth)).point

    def waiting(self, *, rear: bool = False) -> Pose:
        """Return the pose in front of a door, facing it."""
        door, yaw = (self.area.end, self.inward + math.pi) if rear else (self.area.start, self.inward)
        return Pose(door.x, door.y, wrap_angle(yaw)).compose(Pose(-self.sill - self.distance))

    @property
    def entrance(self) -> Pose:
        """Pose in front of the door that rides use, facing it: the front one, or the rear one if that is all it has."""
        return self.waiting(rear=self.doors is DoorType.REAR)

    def relation(self, here: Pose, radius: float) -> PoseRelation:
        """Return the place of the robot's middle; over the sill if its hull (``radius``, m) reaches across."""
        if self.area.contains(here):
            return PoseRelation.IN
        reach = self.sill + radius
        before = Pose(self.area.start.x, self.area.start.y, self.inward).compose(Pose(-reach)).point
        behind = Pose(self.area.end.x, self.area.end.y, self.inward).compose(Pose(reach)).point
        start = self.area.start if self.doors is DoorType.REAR else before
        end = self.area.end if self.doors is DoorType.FRONT else behind
        return PoseRelation.AT_SILL if replace(self.area, start=start, end=end).contains(here) else PoseRelation.OUT

    @property
    def info(self) -> ElevatorInfo:
        """Return the elevator in the API's form."""
        front = [] if self.doors is DoorType.REAR else [pose3d(self.waiting())]
        rear = [] if self.doors is DoorType.FRONT else [pose3d(self.waiting(rear=True))]
        return ElevatorInfo(self.doors, self.id, front, rear)


def elevators_of(drawn: Annotations) -> list[Elevator]:
    """Return the elevators drawn on a map; areas without extent do not count."""
    return [_elevator(area) for area in drawn.areas_of(AreaKind.ELEVATOR) if area.start != area.end]


def _elevator(area: Area) -> Elevator:
    words = dict(area.metadata)
    doors = DOORS.get(words.get("elevator_door_type", ""), DoorType.FRONT)
    sill, distance = (
        _metres(words, key, default)
        for key, default in (("elevator_sill_width", SILL), ("elevator_scheduling_point_dist", WAITING))
    )
    return Elevator(words.get("elevator_id") or str(area.id), area, doors, sill, distance)


def _metres(words: dict[str, str], key: str, default: float) -> float:
    try:
        value = number(words, key, LENGTH_MAX)
    except MetadataError:
        value = None
    return default if value is None else value


def elevators_here(robot: Robot) -> list[Elevator]:
    """Return the elevators of the map in memory."""
    return elevators_of(robot[MapAnnotations].current)


def elevator_around(robot: Robot) -> str:
    """Return the id of the robot's elevator; empty outside. Raises ComponentMissing without Localization."""
    car = car_around(robot)
    return car.id if car is not None else ""


def car_around(robot: Robot) -> Elevator | None:
    """Return the elevator that the robot is in. Raises ComponentMissing without Localization."""
    here = robot[Localization].pose
    return next((elevator for elevator in elevators_here(robot) if elevator.area.contains(here)), None)


def elevator_called(robot: Robot, id: str) -> Elevator:
    """Return the elevator with this id; 400 if there is none, as in the manual."""
    for elevator in elevators_here(robot):
        if elevator.id == id:
            return elevator
    raise HttpError(400, "Unknown Elevator ID", f"the map has no elevator {id}")


@TABLE.on(f"GET {API}", right=Right.SEE, needs=(MapAnnotations,))
def get_elevators(context: Context) -> list[ElevatorInfo]:
    """Return the elevators of this floor and their waiting places."""
    return [elevator.info for elevator in elevators_here(context.robot)]


@TABLE.on(f"GET {API}/{{elevator_id}}", right=Right.SEE, needs=(MapAnnotations,))
def get_elevators_by_id(context: Context, elevator_id: Identifier) -> ElevatorInfo:
    """Return an elevator; 400 if there is none."""
    return elevator_called(context.robot, elevator_id).info


@TABLE.on(f"GET {API}/{{elevator_id}}/pose_relation", right=Right.SEE, needs=(Localization, MapAnnotations))
def get_pose_relation_to_elevator(context: Context, elevator_id: Identifier) -> PoseRelation:
    """Return whether the robot is in the elevator, over its sill or outside; 400 if there is none."""
    robot = context.robot
    return elevator_called(robot, elevator_id).relation(robot[Localization].pose, robot.description.radius)
