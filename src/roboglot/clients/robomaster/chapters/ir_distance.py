"""The infrared distance chapter (manual 3.2.11). mm in the manual, cm from robots; nothing is converted here."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off


class IrDistanceSensor(Chapter):
    """``client.ir_distance_sensor``."""

    async def measure(self, on: bool) -> None:
        """Switch all sensors (3.2.11.1)."""
        await self._do("ir_distance_sensor measure", on_off(on))

    async def get_distance(self, id: int) -> float:
        """Return the distance, mm; real robots: cm (3.2.11.2)."""
        return await self._number(f"ir_distance_sensor distance {id:d}")
