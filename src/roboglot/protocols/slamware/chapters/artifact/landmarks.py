"""Chapter "artifact": laser landmarks, reflectors at known places."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated

import msgspec

from roboglot.model.components.mapping.annotations import Annotations, MapAnnotations
from roboglot.model.components.mapping.laser_landmarks import LaserLandmarks
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.maps import PointOfInterest
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import entry_of, pose_of
from roboglot.wire.slamware.chapters.artifact import Identifier, PoseEntry, metadata_text
from roboglot.wire.slamware.chapters.slam.localization import Switch

API = "/api/core/artifact/v1/laser-landmarks"


@TABLE.on(f"GET {API}", right=Right.SEE, needs=(MapAnnotations,))
def get_laser_landmarks(context: Context) -> list[PoseEntry]:
    """Return landmarks found by the lidar and those that were set."""
    return [entry_of(mark) for mark in context.robot[MapAnnotations].current.landmarks]


def _landmark(entry: PoseEntry) -> PointOfInterest:
    if entry.pose is None:
        raise InvalidGoal(f"the landmark {entry.id} needs a pose")
    return PointOfInterest(entry.id, pose_of(entry.pose), metadata_text(entry.metadata))


@TABLE.on(f"PUT {API}", right=Right.EDIT, needs=(MapAnnotations,))
async def put_laser_landmarks(
    context: Context, body: Annotated[list[PoseEntry], msgspec.Meta(max_length=2000)]
) -> bool:
    """Replace all landmarks."""
    marks = {entry.id: _landmark(entry) for entry in body}
    await context.robot[MapAnnotations].change(lambda now: replace(now, landmarks=tuple(marks.values())))
    return True


@TABLE.on(f"GET {API}/:update", right=Right.SEE, needs=(LaserLandmarks,))
def get_laser_landmark_update(context: Context) -> bool:
    """Return whether the robot adds landmarks found by its lidar."""
    return context.robot[LaserLandmarks].updating


@TABLE.on(f"PUT {API}/:update", right=Right.EDIT, needs=(LaserLandmarks,))
async def set_laser_landmark_update(context: Context, body: Switch) -> bool:
    """Switch the adding of landmarks found by the lidar."""
    await context.robot[LaserLandmarks].set_updating(body.enable)
    return True


@TABLE.on(f"DELETE {API}", right=Right.EDIT, needs=(MapAnnotations,))
async def delete_laser_landmarks(context: Context) -> bool:
    """Remove all landmarks."""
    await context.robot[MapAnnotations].change(lambda now: replace(now, landmarks=()))
    return True


@TABLE.on(f"POST {API}/:remove", right=Right.EDIT, needs=(MapAnnotations,))
async def remove_laser_landmarks(
    context: Context, body: Annotated[list[Identifier | int], msgspec.Meta(max_length=2000)]
) -> bool:
    """Remove landmarks by id, all or none; 404 if one does not exist. Ids are numbers here, UUIDs elsewhere."""
    ids = {str(id) for id in body}

    def edit(now: Annotations) -> Annotations:
        if missing := ids - {mark.id for mark in now.landmarks}:
            raise NotFound(f"no landmarks {sorted(missing)[:20]}")
        return replace(now, landmarks=tuple(mark for mark in now.landmarks if mark.id not in ids))

    await context.robot[MapAnnotations].change(edit)
    return True
