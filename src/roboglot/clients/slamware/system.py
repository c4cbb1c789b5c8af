"""Chapter "system": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from typing import Literal

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.clients.slamware.values import JackStatus, NetworkStatusAnswer, RawImu, Scan
from roboglot.wire.slamware.devices import LightControl, Parameter, Restart, Shutdown
from roboglot.wire.slamware.network import ApnStatus, NetworkRequest, RouteStatus
from roboglot.wire.slamware.system import BaseHealthInfo, BatteryPack, Capability, DeviceInfo, PowerStatus


class System(Chapter):
    """Chapter "system"."""

    @call("GET /api/core/system/v1/capabilities")
    async def get_capabilities(self) -> list[Capability]:
        """Return the capabilities of the robot; ``core`` is enabled once it can drive and its lidar turns."""

    @call("GET /api/core/system/v1/power/status")
    async def get_power_status(self) -> PowerStatus:
        """Battery, dock and how awake the robot is."""

    @call("POST /api/core/system/v1/power/:shutdown")
    async def shutdown(self, body: Shutdown) -> bool:
        """Switch off, at once or later, and perhaps on again. No requests are answered while it is off."""

    @call("POST /api/core/system/v1/power/:hibernate")
    async def hibernate(self) -> None:
        """Sleep: the lidar rests and nothing moves until it is woken up."""

    @call("POST /api/core/system/v1/power/:wakeup")
    async def wakeup(self) -> None:
        """Wake up, which takes some seconds."""

    @call("POST /api/core/system/v1/power/:restartmodule")
    async def restart_module(self, body: Restart) -> bool:
        """Restart. No requests are answered meanwhile."""

    @call("GET /api/core/system/v1/robot/info")
    async def get_robot_info(self) -> DeviceInfo:
        """The name plate. Numbers that only the vendor hands out are made from the names, the same at every start."""

    @call("GET /api/core/system/v1/robot/health")
    async def get_robot_health(self) -> BaseHealthInfo:
        """Return the current faults."""

    @call("DELETE /api/core/system/v1/robot/health/{error_code}")
    async def clear_robot_health(self, error_code: int) -> None:
        """Dismiss a record; it comes back while its cause persists. 400 for a code that is not there."""

    @call("GET /api/core/system/v1/laserscan")
    async def get_laser_scan(self) -> Scan:
        """The last turn of the lidar (rad from straight ahead, m) and the robot's pose then."""

    @call("GET /api/core/system/v1/parameter")
    async def get_system_parameter(self, param: str) -> str:
        """Top speeds in m/s and rad/s, as text with six decimals; when the robot registers a dock that it touches."""

    @call("PUT /api/core/system/v1/parameter")
    async def set_system_parameter(self, body: Parameter) -> bool:
        """Speed limits, emergency stop, brake release."""

    @call("GET /api/core/system/v1/network/status")
    async def get_network_status(self) -> NetworkStatusAnswer:
        """Get the network state."""

    @call("PUT /api/core/system/v1/network/status")
    async def set_network_status(self, body: NetworkRequest) -> bool:
        """Set the network mode."""

    @call("GET /api/core/system/v1/network/route")
    async def get_network_route(self) -> RouteStatus:
        """Get the routing priority."""

    @call("PUT /api/core/system/v1/network/route")
    async def set_network_route(self, body: RouteStatus) -> None:
        """Set the routing priority."""

    @call("GET /api/core/system/v1/network/apn")
    async def get_cmlink_apn(self) -> ApnStatus:
        """Get the cmlink APN."""

    @call("PUT /api/core/system/v1/network/apn")
    async def set_cmlink_apn(self, body: ApnStatus) -> None:
        """Set the cmlink APN."""

    @call("PUT /api/core/system/v1/cube/config")
    async def set_cube_config(self, body: bytes) -> None:
        """Set the Cube configuration."""

    @call("POST /api/core/system/v1/light/control")
    async def set_light_control(self, body: LightControl) -> None:
        """Show this on one half of a channel from now on; 500 if the robot has no such strip."""

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

    @call("GET /api/core/system/v1/battery/pack")
    async def get_battery_pack(self) -> BatteryPack:
        """Current (mA, positive: charging) and temperature (0.1 degrees Celsius)."""

    @call("GET /api/core/system/v1/rawimu")
    async def get_imu_raw_data(self) -> RawImu:
        """Get the raw values of the IMU."""
