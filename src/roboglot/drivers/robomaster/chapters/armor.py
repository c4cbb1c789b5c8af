"""The armor of an EP. A setting counts as soon as it is sent; a refusal restores the value before it."""

from __future__ import annotations

from functools import partial

from roboglot.clients.robomaster.client import RoboMasterClient
from roboglot.drivers.setting import Setting
from roboglot.drivers.supervisor import Supervisor
from roboglot.model.components.interaction.armor import Armor, PlatePlace, check_sensitivity

AROUND = (PlatePlace.REAR, PlatePlace.FRONT, PlatePlace.LEFT, PlatePlace.RIGHT)
AT_GIMBAL = (PlatePlace.GIMBAL_LEFT, PlatePlace.GIMBAL_RIGHT)


class RoboMasterArmor(Armor):
    """Sensitivity and plates. Hits arrive on the event port; the TelemetryListener publishes them."""

    def __init__(self, client: RoboMasterClient, supervisor: Supervisor) -> None:
        self._client = client
        self.plates = AROUND
        self._sensitivity = Setting(supervisor, 5)

    async def probe(self, *, gimbal: bool) -> None:
        """Poll the sensitivity and subscribe to hits."""
        self._sensitivity.read(await self._client.armor.get_sensitivity())
        await self._client.armor.event(True)
        self.plates = (*AROUND, *AT_GIMBAL) if gimbal else AROUND

    @property
    def sensitivity(self) -> int:
        return self._sensitivity.value

    def set_sensitivity(self, sensitivity: int) -> None:
        check_sensitivity(sensitivity)
        command = partial(self._client.armor.sensitivity, sensitivity)
        self._sensitivity.send("setting the sensitivity", sensitivity, command)
