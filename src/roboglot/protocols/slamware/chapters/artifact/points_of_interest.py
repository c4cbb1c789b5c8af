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
def get_current_pois(context: Context) -> list[PoseEntry]:
    """Return all points of interest, oldest first."""
    return [entry_of(place) for place in context.robot[Places].all()]


@TABLE.on(f"POST {API}", right=Right.EDIT, needs=(Localization, Places))
async def add_pois(context: Context, body: PoseEntry) -> None:
    """Add a point, or replace the one with its id; by default at the robot's current pose."""
    pose = pose_of(body.pose) if body.pose else context.robot[Localization].pose
    await context.robot[Places].put(PointOfInterest(body.id, pose, metadata_text(body.metadata)))


@TABLE.on(f"DELETE {API}", right=Right.EDIT, needs=(Places,))
async def clear_pois(context: Context) -> bool:
    """Remove all points of interest."""
    await context.robot[Places].clear()
    return True


@TABLE.on(f"POST {API}/:adjust", right=Right.EDIT, needs=(Places,))
async def adjust_pois(context: Context) -> None:
    """Move places from before a loop closure to their poses on the corrected map."""
    await context.shifts.adjust()


@TABLE.on(f"GET {API}/{{poi_id}}", right=Right.SEE, needs=(Places,))
def get_poi_by_id(context: Context, poi_id: Identifier) -> PoseEntry:
    """Return a point; 404 if there is none."""
    return entry_of(context.robot[Places].get(poi_id))


@TABLE.on(f"PUT {API}/{{poi_id}}", right=Right.EDIT, needs=(Places,))
async def modify_poi(context: Context, poi_id: Identifier, body: PoseChange) -> bool:
    """Change a point's pose, metadata or both; 404 if there is none."""

    def edit(old: PointOfInterest) -> PointOfInterest:
        metadata = old.metadata if body.metadata is None else metadata_text(body.metadata)
        return PointOfInterest(poi_id, pose_of(body.pose) if body.pose else old.pose, metadata)

    await context.robot[Places].modify(poi_id, edit)
    return True


@TABLE.on(f"DELETE {API}/{{poi_id}}", right=Right.EDIT, needs=(Places,))
async def delete_poi(context: Context, poi_id: Identifier) -> bool:
    """Remove a point; 404 if there is none."""
    await context.robot[Places].remove(poi_id)
    return True
