"""Charging docks on the map, and the robot's home among them: the bound one, else the first."""

from __future__ import annotations

import uuid
from collections.abc import Callable
from dataclasses import replace

from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.motion.docking import BEFORE_DOCK, Docking
from roboglot.model.components.system.settings import Settings
from roboglot.model.geometry import Pose
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot

BOUND = "slamware.home_dock"  # the setting that holds the bound dock's id
NAME = "display_name"
Docks = tuple[PointOfInterest, ...]


def known_docks(robot: Robot) -> Docks:
    """Return the docks on the map, or else the one that the robot found by itself."""
    docking, entered = robot[Docking], robot[MapAnnotations].current.docks
    if entered or docking.home is None:
        return entered
    return (own_dock(robot, docking.home),)


def own_dock(robot: Robot, pose: Pose) -> PointOfInterest:
    """Return the dock that a robot without any has at ``pose``."""
    id = uuid.uuid5(uuid.NAMESPACE_OID, f"{robot.description.serial} home dock")
    return PointOfInterest(str(id), pose, {NAME: "home"})


def home_dock(robot: Robot) -> PointOfInterest | None:
    """Return the bound dock, else the first."""
    docks, bound = known_docks(robot), robot[Settings].get(BOUND)
    return next((dock for dock in docks if dock.id == bound), docks[0] if docks else None)


def before(dock: PointOfInterest) -> Pose:
    """Return the pose of a robot in front of ``dock``."""
    return dock.pose.compose(Pose(BEFORE_DOCK))


def settle_home(robot: Robot) -> None:
    """Set the robot's home to its dock on the map."""
    dock = home_dock(robot)
    robot[Docking].set_home(dock.pose if dock else None)


async def change_docks(robot: Robot, edit: Callable[[Docks], Docks]) -> None:
    """Replace the docks by ``edit`` of them; an error of ``edit`` is raised."""
    changed: Docks = ()

    def work(docks: Docks) -> Docks:
        nonlocal changed
        changed = edit(docks)
        return changed

    await robot[MapAnnotations].change(lambda now: replace(now, docks=work(known_docks(robot))))
    if not changed:
        robot[Docking].set_home(None)
    settle_home(robot)
