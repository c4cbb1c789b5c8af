"""Chapter "slam": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.slam.explore_map import ExploreMap
from roboglot.wire.slamware.chapters.slam.localization import NewOrigin
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap
from roboglot.wire.slamware.geometry import Rectangle


class Maps(Chapter):
    """Chapter "slam"."""

    @call("GET /api/core/slam/v1/knownarea")
    async def get_known_area(self) -> Rectangle:
        """Return the extent of the map, m."""

    @call("GET /api/core/slam/v1/maps/explore")
    async def get_explore_map(
        self,
        min_x: float | None = None,
        min_y: float | None = None,
        max_x: float | None = None,
        max_y: float | None = None,
    ) -> ExploreMap:
        """Return the map (see the wire's explore_map), whole or cut to a window in m."""

    @call("GET /api/core/slam/v1/maps/stcm")
    async def get_composite_map(self) -> CompositeMap:
        """Return the map with everything drawn on it; 403 while a map is being loaded."""

    @call("PUT /api/core/slam/v1/maps/stcm")
    async def set_composite_map(self, body: CompositeMap) -> None:
        """Load a map with everything drawn on it, in memory only; the robot's pose becomes the origin."""

    @call("DELETE /api/core/slam/v1/maps")
    async def clear_map(self) -> None:
        """Discard the map and begin a new one at the robot. Docks stay at their places, with new coordinates."""

    @call("PUT /api/core/slam/v1/maps/origin")
    async def move_origin_point(self, body: NewOrigin) -> None:
        """Move the map's origin to a place, to the nearest 5 cm; everything drawn on the map moves, too."""
