"""Chapter "sensors": its operations as typed methods."""

# mypy: disable-error-code="empty-body"
# The bodies are made by @call from the signatures.

from __future__ import annotations

from roboglot.clients.slamware.calls import Chapter, call
from roboglot.wire.slamware.chapters.slam.localization import Switch
from roboglot.wire.slamware.chapters.system.devices import DisabledSensor, SensorSwitch


class Sensors(Chapter):
    """Chapter "sensors"."""

    @call("PUT /api/core/sensors/v1/depth/:enable")
    async def set_depth_sensor_state(self, body: Switch) -> None:
        """Switch the depth camera."""

    @call("GET /api/core/sensors/v1/masks")
    async def get_disabled_sensors_mask_data(self) -> list[DisabledSensor]:
        """Return the sensors that are switched off."""

    @call("PUT /api/core/sensors/v1/masks")
    async def set_sensor_mask(self, body: list[SensorSwitch]) -> bool:
        """Switch sensors off and on, all or none; 404 if one does not exist."""
