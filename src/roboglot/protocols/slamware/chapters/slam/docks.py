"""Chapter "slam": the home pose and the charging docks."""

from __future__ import annotations

import uuid
from dataclasses import replace
from typing import Annotated

import msgspec

from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import DockNotFound, InvalidGoal, NotFound, RobotError
from roboglot.model.maps import PointOfInterest
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.motion.home_docks import (
    BOUND,
    NAME,
    Docks,
    change_docks,
    home_dock,
    known_docks,
    own_dock,
)
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import entry_of, pose3d, pose_of
from roboglot.wire.slamware.chapters.artifact import Identifier, PoseChange, PoseEntry, metadata_text
from roboglot.wire.slamware.chapters.slam.localization import Registration
from roboglot.wire.slamware.geometry import Pose3D

API = "/api/core/slam/v1"
SAME_PLACE = 0.05  # m within which a home pose is that of a dock on the map


def _entered(robot: Robot, entry: PoseEntry) -> PointOfInterest:
    metadata = metadata_text(entry.metadata)
    if not metadata.get(NAME):
        raise InvalidGoal(f"a dock's metadata need a {NAME}")
    return PointOfInterest(entry.id, pose_of(entry.pose) if entry.pose else robot[Localization].pose, metadata)


@TABLE.on(f"GET {API}/homepose", right=Right.SEE, needs=(Docking,))
def get_home_pose(context: Context) -> Pose3D:
    """Return the robot's pose when docked; 404 if it knows no dock."""
    if (home := context.robot[Docking].home) is None:
        raise DockNotFound("the map has no dock")
    return pose3d(home)


@TABLE.on(f"PUT {API}/homepose", right=Right.EDIT, needs=(Docking, MapAnnotations, Settings))
async def set_home_pose(context: Context, body: Pose3D) -> bool:
    """Choose the dock at this place as home, or move the home dock here; by the robot's pose when docked."""
    robot, pose = context.robot, pose_of(body)
    home = home_dock(robot) or own_dock(robot, pose)
    at = [dock for dock in known_docks(robot) if dock.pose.distance_to(pose) < SAME_PLACE]
    chosen = at[0] if at and home not in at else home
    moved, bound = replace(chosen, pose=pose), robot[Settings].get(BOUND)

    def edit(docks: Docks) -> Docks:
        if chosen is home:
            return tuple(moved if dock.id == moved.id else dock for dock in docks or (moved,))
        return (moved, *(dock for dock in docks if dock.id != moved.id))

    if bound == home.id:
        await robot[Settings].put(BOUND, chosen.id)
    try:
        await change_docks(robot, edit)
    except RobotError:
        await robot[Settings].keep(BOUND, bound)
        raise
    return True


@TABLE.on(f"GET {API}/homedocks", right=Right.SEE, needs=(Docking, MapAnnotations, Settings))
def get_home_docks(context: Context) -> list[PoseEntry]:
    """Return the docks on the map."""
    return [entry_of(dock) for dock in known_docks(context.robot)]


@TABLE.on(f"PUT {API}/homedocks", right=Right.EDIT, needs=(Docking, Localization, MapAnnotations, Settings))
async def set_home_docks(context: Context, body: Annotated[list[PoseEntry], msgspec.Meta(max_length=1000)]) -> bool:
    """Replace all docks; each needs a name."""
    docks = {entry.id: _entered(context.robot, entry) for entry in body}
    await change_docks(context.robot, lambda _: tuple(docks.values()))
    return True


@TABLE.on(f"POST {API}/homedocks", right=Right.EDIT, needs=(Docking, Localization, MapAnnotations, Settings))
async def add_home_dock(context: Context, body: PoseEntry) -> bool:
    """Add a dock with a name, or replace the one with its id."""
    dock = _entered(context.robot, body)
    await change_docks(context.robot, lambda docks: (*(d for d in docks if d.id != dock.id), dock))
    return True


@TABLE.on(f"DELETE {API}/homedocks", right=Right.EDIT, needs=(Docking, MapAnnotations, Settings))
async def clear_home_docks(context: Context) -> PoseEntry | None:
    """Remove all docks; return the home dock, as the manual has it, or null."""
    home = home_dock(context.robot)
    await change_docks(context.robot, lambda _: ())
    return entry_of(home) if home else None


@TABLE.on(f"POST {API}/homedocks/:register", right=Right.EDIT, needs=(Docking, Localization, MapAnnotations, Settings))
async def register_home_dock(context: Context, body: Registration) -> PoseEntry:
    """Register a dock where the robot stands."""
    robot = context.robot
    made = f"{robot.description.serial} dock {robot.clock.epoch()}"
    dock = _entered(robot, PoseEntry(str(uuid.uuid5(uuid.NAMESPACE_OID, made)), None, body.metadata))
    await change_docks(robot, lambda docks: (*(d for d in docks if d.id != dock.id), dock))
    return entry_of(dock)


def _one(docks: Docks, id: str) -> PointOfInterest:
    found = next((dock for dock in docks if dock.id == id), None)
    if found is None:
        raise NotFound(f"there is no dock {id}")
    return found


@TABLE.on(f"PUT {API}/homedocks/{{dock_id}}", right=Right.EDIT, needs=(Docking, MapAnnotations, Settings))
async def edit_home_dock(context: Context, dock_id: Identifier, body: PoseChange) -> bool:
    """Change a dock's pose, metadata or both; it keeps its name without a new one. 404 if there is none."""

    def edit(docks: Docks) -> Docks:
        old = _one(docks, dock_id)
        metadata = dict(old.metadata) if body.metadata is None else metadata_text(body.metadata)
        if not metadata.get(NAME) and NAME in old.metadata:
            metadata[NAME] = old.metadata[NAME]
        new = PointOfInterest(dock_id, pose_of(body.pose) if body.pose else old.pose, metadata)
        return tuple(new if dock is old else dock for dock in docks)

    await change_docks(context.robot, edit)
    return True


@TABLE.on(f"DELETE {API}/homedocks/{{dock_id}}", right=Right.EDIT, needs=(Docking, MapAnnotations, Settings))
async def erase_home_dock(context: Context, dock_id: Identifier) -> bool:
    """Remove a dock; 404 if there is none."""

    def edit(docks: Docks) -> Docks:
        gone = _one(docks, dock_id)
        return tuple(dock for dock in docks if dock is not gone)

    await change_docks(context.robot, edit)
    return True
