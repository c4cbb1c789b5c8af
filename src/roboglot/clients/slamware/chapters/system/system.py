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
        """Return the state of battery, dock and sleep."""

    @call("POST /api/core/system/v1/power/:shutdown")
    async def shutdown(self, body: Shutdown) -> bool:
        """Switch off, at once or later, and optionally on again; no answers while off."""

    @call("POST /api/core/system/v1/power/:hibernate")
    async def hibernate(self) -> None:
        """Put the robot to sleep: the lidar rests and no motion is possible until ``wakeup``."""

    @call("POST /api/core/system/v1/power/:wakeup")
    async def wakeup(self) -> None:
        """Wake the robot up, which takes some seconds."""

    @call("POST /api/core/system/v1/power/:restartmodule")
    async def restart_module(self, body: Restart) -> bool:
        """Restart a module; no answers meanwhile."""

    @call("GET /api/core/system/v1/robot/info")
    async def get_robot_info(self) -> DeviceInfo:
        """Return the name plate."""

    @call("GET /api/core/system/v1/robot/health")
    async def get_robot_health(self) -> BaseHealthInfo:
        """Return the current faults."""

    @call("DELETE /api/core/system/v1/robot/health/{error_code}")
    async def clear_robot_health(self, error_code: int) -> None:
        """Dismiss a fault, which comes back while its cause persists; 400 for a code without a record."""

    @call("GET /api/core/system/v1/parameter")
    async def get_system_parameter(self, param: str) -> str:
        """Return a parameter as text, such as a top speed in m/s or rad/s."""

    @call("PUT /api/core/system/v1/parameter")
    async def set_system_parameter(self, body: Parameter) -> bool:
        """Set a parameter: speed limits, emergency stop, brake release."""

    @call("PUT /api/core/system/v1/cube/config")
    async def set_cube_config(self, body: bytes) -> None:
        """Set the Cube configuration."""

    @call("GET /api/core/system/v1/battery/pack")
    async def get_battery_pack(self) -> BatteryPack:
        """Return current (mA, positive: charging) and temperature (0.1 degrees Celsius)."""
