"""Chapter "slam": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.artifact import PoseChange, PoseEntry
from roboglot.wire.slamware.chapters.slam.localization import Registration


class Docks(Chapter):
    """Chapter "slam"."""

    @call("GET /api/core/slam/v1/homedocks")
    async def get_home_docks(self) -> list[PoseEntry]:
        """Return the docks on the map."""

    @call("PUT /api/core/slam/v1/homedocks")
    async def set_home_docks(self, body: list[PoseEntry]) -> bool:
        """Replace all docks; each needs a name."""

    @call("POST /api/core/slam/v1/homedocks")
    async def add_home_dock(self, body: PoseEntry) -> bool:
        """Add a dock with a name, or replace the one with its id."""

    @call("DELETE /api/core/slam/v1/homedocks")
    async def clear_home_docks(self) -> object:
        """Remove all docks; return the home dock."""

    @call("POST /api/core/slam/v1/homedocks/:register")
    async def register_home_dock(self, body: Registration) -> PoseEntry:
        """Register a dock where the robot stands."""

    @call("PUT /api/core/slam/v1/homedocks/{dock_id}")
    async def edit_home_dock(self, dock_id: str, body: PoseChange) -> bool:
        """Change pose, metadata or both; 404 if there is none."""

    @call("DELETE /api/core/slam/v1/homedocks/{dock_id}")
    async def erase_home_dock(self, dock_id: str) -> bool:
        """Remove one, or 404."""
