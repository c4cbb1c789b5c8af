"""Floor and place at which a robot that was off continues on the map on disk."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.mapping.annotations import Area, AreaKind
from roboglot.model.components.mapping.floors import Floors
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.protocols.slamware.chapters.slam.composite import FloorMap
from roboglot.protocols.slamware.chapters.slam.last_place import LastPlace, is_docked


def resumed(
    robot: Robot, floors: Sequence[FloorMap], digest: str, last: LastPlace | None
) -> tuple[FloorMap, Pose | None] | None:
    """Return floor and pose of the ``last`` place (pose None: at its dock); None if the place is unknown.

    A robot that has come onto its dock while it was off, or has left it, was moved; so was a robot that is set up at
    another of the lift's stops: it is on that floor, where the scans have to find it.
    """
    floor = next((floor for floor in floors if last and (digest, floor.name.map_id) == (last.digest, last.floor)), None)
    if last is None or floor is None or last.docked < is_docked(robot):
        return None
    here = _floor_here(robot, floors, floor.name.building)
    if here is not None and here is not floor:
        return here, _in_same_car(last.pose, floor, here)
    return floor, last.pose if last.docked == is_docked(robot) else None


def _floor_here(robot: Robot, floors: Sequence[FloorMap], building: str) -> FloorMap | None:
    """Return the floor with the name of the lift's stop at which the robot is; None if there is no such."""
    if Floors not in robot or LiftClient not in robot:
        return None
    stop = robot[LiftClient].floors[robot[Floors].current]
    return next((floor for floor in floors if (floor.name.building, floor.name.floor) == (building, stop)), None)


def _in_same_car(pose: Pose, floor: FloorMap, here: FloorMap) -> Pose | None:
    """Return a ``pose`` in a car on ``floor`` as seen when the car is ``here``; None outside of cars."""
    cars = {_identifier(car): _inward(car) for car in here.annotations.areas_of(AreaKind.ELEVATOR)}
    for car in floor.annotations.areas_of(AreaKind.ELEVATOR):
        if car.contains(pose) and _identifier(car) in cars:
            return cars[_identifier(car)].compose(pose.relative_to(_inward(car)))
    return None


def _identifier(car: Area) -> str:
    return dict(car.metadata).get("elevator_id") or str(car.id)


def _inward(car: Area) -> Pose:
    """Return the pose at the front door, facing into the car."""
    return Pose(car.start.x, car.start.y, car.start.bearing_to(car.end))
