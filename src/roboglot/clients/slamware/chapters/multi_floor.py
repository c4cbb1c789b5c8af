"""Chapter "multi-floor": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import ElevatorInfo
from roboglot.wire.slamware.chapters.motion import PathPoints
from roboglot.wire.slamware.chapters.multi_floor import (
    BoundDock,
    CurrentFloorInfo,
    DockChoice,
    DockInfo,
    FloorChoice,
    FloorInfo,
    MultiFloorStatus,
    NearbyPoi,
    PoiChoice,
    PoiInfo,
    PoseRelation,
    Reload,
    TrackQuery,
    Unbinding,
)
from roboglot.wire.slamware.chapters.slam.stcm import CompositeMap


class MultiFloor(Chapter):
    """Chapter "multi-floor"."""

    @call("GET /api/multi-floor/status")
    async def get_status(self) -> MultiFloorStatus:
        """Return the state of the map on disk."""

    @call("GET /api/multi-floor/map/v1/floors")
    async def get_floors(self) -> list[FloorInfo]:
        """Return the floors of the loaded map; none without one."""

    @call("GET /api/multi-floor/map/v1/floors/:current")
    async def get_current_floor(self) -> CurrentFloorInfo:
        """Return the floor of the map in memory, and the robot's elevator, if any."""

    @call("PUT /api/multi-floor/map/v1/floors/:current")
    async def set_current_floor(self, body: FloorChoice) -> None:
        """Switch to the map of the floor to which the robot was carried. 404 if it is not loaded."""

    @call("GET /api/multi-floor/map/v1/pois")
    async def get_all_pois(self, floor: str | None = None, building: str | None = None) -> list[PoiInfo]:
        """Return the places of the loaded map, of one floor or of all; new ones only after ``sync_stcm``."""

    @call("POST /api/multi-floor/map/v1/pois/:search_nearby")
    async def search_nearby_poi(self) -> NearbyPoi:
        """Return the nearest place on this floor, in the robot's frame; ON_DOCK, IN_ELEVATOR, or UNKNOWN for none."""

    @call("POST /api/multi-floor/map/v1/pois/:dispatch")
    async def dispatch_by_pois(self, body: list[str]) -> list[str]:
        """Return the names in the order of the robot's shortest round trip from here."""

    @call("GET /api/multi-floor/map/v1/homedocks")
    async def get_mutil_floor_home_docks(self, floor: str | None = None, building: str | None = None) -> list[DockInfo]:
        """Return the docks of the loaded map, of one floor or of all."""

    @call("GET /api/multi-floor/map/v1/homedocks/:current")
    async def get_current_home_dock(self) -> BoundDock:
        """Return the dock to which the robot is bound."""

    @call("PUT /api/multi-floor/map/v1/homedocks/:current")
    async def set_current_home_dock(self, body: DockChoice) -> None:
        """Bind the robot to a dock. For one on another floor, the robot is taken to stand there, and uses its map."""

    @call("POST /api/multi-floor/map/v1/homedocks/:search_nearby")
    async def search_nearby_home_dock(self) -> DockInfo:
        """Return the nearest dock on this floor, in a straight line; 404 if there is none."""

    @call("POST /api/multi-floor/map/v1/stcm")
    async def upload_map(self, body: CompositeMap) -> None:
        """Store a composite map on disk; used from the next reload on. 400 for invalid ones."""

    @call("DELETE /api/multi-floor/map/v1/stcm")
    async def delete_map(self) -> None:
        """Delete the map on disk; the one in memory stays."""

    @call("POST /api/multi-floor/map/v1/stcm/:save")
    async def save_stcm(self) -> None:
        """Save the map in memory to disk; 403 if the one on disk has several floors."""

    @call("POST /api/multi-floor/map/v1/stcm/:reload")
    async def reload_stcm(self, body: Reload | None = None) -> None:
        """Load the map from disk to memory; without a pose the robot is on or before its dock. 404 without a map."""

    @call("POST /api/multi-floor/map/v1/stcm/:sync")
    async def sync_stcm(self) -> None:
        """Save and reload, so that multi-floor operations know newly added places. The robot's pose stays."""

    @call("POST /api/multi-floor/map/v1/scene/unbind")
    async def unbind_scene(self, body: Unbinding | None = None) -> None:
        """Unbind the robot from its cloud; delete the map on disk unless it is to be kept."""

    @call("POST /api/multi-floor/map/v1/search_path_points")
    async def search_path_points_in_graph(self, body: TrackQuery) -> PathPoints:
        """Return the shortest path along the tracks; ``with_direction``: only from their start to their end."""

    @call("PUT /api/multi-floor/localization/v1/pose")
    async def set_pose_by_poi(self, body: PoiChoice) -> bool:
        """Set the robot's pose to a place of the floor, by name or id; 404 if there is none."""

    @call("PUT /api/multi-floor/localization/v1/homedock")
    async def set_pose_by_homedock(self, body: DockChoice | None = None) -> None:
        """Set the robot's pose to the front of this dock, or of its own; 404 if there is none."""

    @call("GET /api/multi-floor/map/v1/elevators")
    async def get_elevators(self) -> list[ElevatorInfo]:
        """Return the elevators of this floor and their waiting poses."""

    @call("GET /api/multi-floor/map/v1/elevators/{elevator_id}")
    async def get_elevators_by_id(self, elevator_id: str) -> ElevatorInfo:
        """Return one elevator; 400 if unknown."""

    @call("GET /api/multi-floor/map/v1/elevators/{elevator_id}/pose_relation")
    async def get_pose_relation_to_elevator(self, elevator_id: str) -> PoseRelation:
        """Return whether the robot is inside, on the sill or outside; 400 without an elevator."""
