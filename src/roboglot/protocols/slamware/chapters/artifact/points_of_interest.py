"""Chapter "artifact": points of interest."""

from __future__ import annotations

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.places import Places
from roboglot.model.maps import PointOfInterest
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import entry_of, pose_of
from roboglot.wire.slamware.chapters.artifact import Identifier, PoseChange, PoseEntry, metadata_text

API = "/api/core/artifact/v1/pois"


@TABLE.on(f"GET {API}", right=Right.SEE, needs=(Places,))
async def get_current_pois(context: Context) -> list[PoseEntry]:
    """All of them, oldest first."""
    return [entry_of(place) for place in context.robot[Places].all()]


@TABLE.on(f"POST {API}", right=Right.EDIT, needs=(Localization, Places))
async def add_pois(context: Context, body: PoseEntry) -> None:
    """Add one, or replace the one with its id; without a pose it is where the robot is now."""
    pose = pose_of(body.pose) if body.pose else context.robot[Localization].pose
    await context.robot[Places].put(PointOfInterest(body.id, pose, metadata_text(body.metadata)))


@TABLE.on(f"DELETE {API}", right=Right.EDIT, needs=(Places,))
async def clear_pois(context: Context) -> bool:
    """Remove all."""
    await context.robot[Places].clear()
    return True


@TABLE.on(f"POST {API}/:adjust", right=Right.EDIT, needs=(Places,))
async def adjust_pois(context: Context) -> None:
    """Put places from before a loop closure to where they are on the straightened map."""
    await context.shifts.adjust()


@TABLE.on(f"GET {API}/{{poi_id}}", right=Right.SEE, needs=(Places,))
async def get_poi_by_id(context: Context, poi_id: Identifier) -> PoseEntry:
    """One, or 404."""
    return entry_of(context.robot[Places].get(poi_id))


@TABLE.on(f"PUT {API}/{{poi_id}}", right=Right.EDIT, needs=(Places,))
async def modify_poi(context: Context, poi_id: Identifier, body: PoseChange) -> bool:
    """Change pose, metadata or both; 404 if there is none."""
    place = context.robot[Places].get(poi_id)
    metadata = place.metadata if body.metadata is None else metadata_text(body.metadata)
    pose = pose_of(body.pose) if body.pose else place.pose
    await context.robot[Places].put(PointOfInterest(poi_id, pose, metadata))
    return True


@TABLE.on(f"DELETE {API}/{{poi_id}}", right=Right.EDIT, needs=(Places,))
async def delete_poi(context: Context, poi_id: Identifier) -> bool:
    """Remove one, or 404."""
    await context.robot[Places].remove(poi_id)
    return True
