"""Chapter "slam": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.slam.localization import ImuData, Switch
from roboglot.wire.slamware.geometry import Pose3D


class Localization(Chapter):
    """Chapter "slam"."""

    @call("GET /api/core/slam/v1/localization/pose")
    async def get_pose(self) -> Pose3D:
        """Return the pose in the map."""

    @call("PUT /api/core/slam/v1/localization/pose")
    async def set_pose(self, body: Pose3D) -> None:
        """Set the pose of the robot in the map."""

    @call("GET /api/core/slam/v1/localization/odopose")
    async def get_odo_pose(self) -> Pose3D:
        """Return the wheel odometry since the start."""

    @call("GET /api/core/slam/v1/localization/quality")
    async def get_localization_quality(self) -> int:
        """Return the fit of the lidar to the map, 0..100."""

    @call("GET /api/core/slam/v1/localization/:enable")
    async def get_map_localization(self) -> bool:
        """Return True if the lidar corrects the pose."""

    @call("PUT /api/core/slam/v1/localization/:enable")
    async def set_map_localization(self, body: Switch) -> bool:
        """Switch the correction of the pose by the lidar; off: by the wheels alone."""

    @call("POST /api/core/slam/v1/localization/status/:reset")
    async def reset_localization_status(self) -> bool:
        """Reset the localisation status."""

    @call("GET /api/core/slam/v1/mapping/:enable")
    async def get_map_update(self) -> bool:
        """Return True if mapping is on."""

    @call("PUT /api/core/slam/v1/mapping/:enable")
    async def set_map_update(self, body: Switch) -> bool:
        """Switch mapping."""

    @call("GET /api/core/slam/v1/loopclosure/:enable")
    async def get_loop_closure(self) -> bool:
        """Return True if loop closure is on."""

    @call("PUT /api/core/slam/v1/loopclosure/:enable")
    async def set_loop_closure(self, body: Switch) -> bool:
        """Switch loop closure."""

    @call("GET /api/core/slam/v1/homepose")
    async def get_home_pose(self) -> Pose3D:
        """Return the docked pose; 404 without a known dock."""

    @call("PUT /api/core/slam/v1/homepose")
    async def set_home_pose(self, body: Pose3D) -> bool:
        """Move the home dock: set the robot's pose when docked."""

    @call("GET /api/core/slam/v1/imu")
    async def get_imu(self) -> ImuData:
        """Return attitude (rad), acceleration (m/s2) and turning rates (rad/s) in the robot's frame."""
