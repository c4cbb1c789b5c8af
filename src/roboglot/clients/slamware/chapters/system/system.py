"""Chapter "system": its operations as typed methods. Units and frames as the robot has them: m, rad, map."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.system.devices import Parameter, Restart, Shutdown
from roboglot.wire.slamware.chapters.system.system import (
    BaseHealthInfo,
    BatteryPack,
    Capability,
    DeviceInfo,
    PowerStatus,
)


class System(Chapter):
    """Chapter "system": power, name plate, health, parameters."""

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

    @call("GET /api/core/system/v1/parameter")
    async def get_system_parameter(self, param: str) -> str:
        """Top speeds in m/s and rad/s, as text with six decimals; when the robot registers a dock that it touches."""

    @call("PUT /api/core/system/v1/parameter")
    async def set_system_parameter(self, body: Parameter) -> bool:
        """Speed limits, emergency stop, brake release."""

    @call("PUT /api/core/system/v1/cube/config")
    async def set_cube_config(self, body: bytes) -> None:
        """Set the Cube configuration."""

    @call("GET /api/core/system/v1/battery/pack")
    async def get_battery_pack(self) -> BatteryPack:
        """Current (mA, positive: charging) and temperature (0.1 degrees Celsius)."""
