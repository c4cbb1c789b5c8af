"""Chapter "artifact": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.artifact import (
    AreaChange,
    AreaRequest,
    AreaUsage,
    Line,
    LineUsage,
    PoseChange,
    PoseEntry,
    RectangleArea,
)
from roboglot.wire.slamware.chapters.slam.localization import Switch


class Artifact(Chapter):
    """Chapter "artifact"."""

    @call("GET /api/core/artifact/v1/lines/{usage}")
    async def get_lines(self, usage: LineUsage) -> list[Line]:
        """List all of one kind, oldest first."""

    @call("POST /api/core/artifact/v1/lines/{usage}")
    async def add_lines(self, usage: LineUsage, body: list[Line]) -> bool:
        """Add lines; the ids in the body are ignored."""

    @call("PUT /api/core/artifact/v1/lines/{usage}")
    async def modify_lines(self, usage: LineUsage, body: list[Line]) -> bool:
        """Change the lines with these ids; 404, without any change, if one of them does not exist."""

    @call("DELETE /api/core/artifact/v1/lines/{usage}")
    async def clear_lines(self, usage: LineUsage) -> bool:
        """Remove all of one kind."""

    @call("DELETE /api/core/artifact/v1/lines/{usage}/{id}")
    async def remove_line_by_id(self, usage: LineUsage, id: int) -> bool:
        """Remove one, or 404."""

    @call("GET /api/core/artifact/v1/rectangle-areas/{usage}")
    async def get_rectangle_areas(self, usage: AreaUsage) -> list[RectangleArea]:
        """List all of one kind, oldest first."""

    @call("POST /api/core/artifact/v1/rectangle-areas/{usage}")
    async def add_rectangle_area(self, usage: AreaUsage, body: AreaRequest) -> bool:
        """Add an area; its metadata must be valid."""

    @call("DELETE /api/core/artifact/v1/rectangle-areas/{usage}")
    async def clear_rectangle_areas(self, usage: AreaUsage) -> bool:
        """Remove all of one kind."""

    @call("PUT /api/core/artifact/v1/rectangle-areas/{usage}/{id}")
    async def edit_rectangle_area(self, usage: AreaUsage, id: int, body: AreaChange) -> bool:
        """Change place, metadata or both; 404 if there is none."""

    @call("DELETE /api/core/artifact/v1/rectangle-areas/{usage}/{id}")
    async def remove_rectangle_area_by_id(self, usage: AreaUsage, id: int) -> bool:
        """Remove one, or 404."""

    @call("GET /api/core/artifact/v1/pois")
    async def get_current_pois(self) -> list[PoseEntry]:
        """List all, oldest first."""

    @call("POST /api/core/artifact/v1/pois")
    async def add_pois(self, body: PoseEntry) -> None:
        """Add a point or replace one with the same id; without a pose, at the robot's current pose."""

    @call("DELETE /api/core/artifact/v1/pois")
    async def clear_pois(self) -> bool:
        """Remove all."""

    @call("POST /api/core/artifact/v1/pois/:adjust")
    async def adjust_pois(self) -> None:
        """Optimise the poses of points of interest."""

    @call("GET /api/core/artifact/v1/pois/{poi_id}")
    async def get_poi_by_id(self, poi_id: str) -> PoseEntry:
        """Return one; 404 if unknown."""

    @call("PUT /api/core/artifact/v1/pois/{poi_id}")
    async def modify_poi(self, poi_id: str, body: PoseChange) -> bool:
        """Change pose, metadata or both; 404 if there is none."""

    @call("DELETE /api/core/artifact/v1/pois/{poi_id}")
    async def delete_poi(self, poi_id: str) -> bool:
        """Remove one, or 404."""

    @call("GET /api/core/artifact/v1/laser-landmarks")
    async def get_laser_landmarks(self) -> list[PoseEntry]:
        """Return all landmarks."""

    @call("DELETE /api/core/artifact/v1/laser-landmarks")
    async def delete_laser_landmarks(self) -> bool:
        """Remove all."""

    @call("PUT /api/core/artifact/v1/laser-landmarks")
    async def put_laser_landmarks(self, body: list[PoseEntry]) -> bool:
        """Replace all landmarks."""

    @call("GET /api/core/artifact/v1/laser-landmarks/:update")
    async def get_laser_landmark_update(self) -> bool:
        """Return True if automatic update of laser landmarks is enabled."""

    @call("PUT /api/core/artifact/v1/laser-landmarks/:update")
    async def set_laser_landmark_update(self, body: Switch) -> bool:
        """Allow or forbid automatic update of laser landmarks."""

    @call("POST /api/core/artifact/v1/laser-landmarks/:remove")
    async def remove_laser_landmarks(self, body: list[str | int]) -> bool:
        """Remove landmarks by id, all or none; 404 if one does not exist."""
