"""Chapter "system": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from typing import Literal

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import JackStatus, RawImu, Scan
from roboglot.wire.slamware.chapters.system.devices import LightControl


class Devices(Chapter):
    """Chapter "system": lidar, IMU, lights, jack, emergency braking."""

    @call("GET /api/core/system/v1/laserscan")
    async def get_laser_scan(self) -> Scan:
        """Return the last turn of the lidar (rad from straight ahead, m) and the robot's pose at that time."""

    @call("POST /api/core/system/v1/light/control")
    async def set_light_control(self, body: LightControl) -> None:
        """Set the light on one half of a channel; 500 if the robot has no such strip."""

    @call("POST /api/core/system/v1/aeb/control")
    async def set_aeb_control(self, body: Literal["On", "Off"]) -> None:
        """Switch automatic emergency braking."""

    @call("POST /api/core/system/v1/jack/status")
    async def set_jack_req(self, body: Literal["Up", "Down", "Stop", "ClearAlarm"]) -> None:
        """Lift, set down, stop, or acknowledge the alarm."""

    @call("GET /api/core/system/v1/jack/status")
    async def get_jack_status(self) -> JackStatus:
        """Return the state of the platform."""

    @call("GET /api/core/system/v1/rawadcimu")
    async def get_imu_raw_adc_data(self) -> RawImu:
        """Get the raw ADC values of the IMU."""

    @call("GET /api/core/system/v1/rawimu")
    async def get_imu_raw_data(self) -> RawImu:
        """Get the raw values of the IMU."""
