"""The sensor adapter chapter (manual 3.2.10). V in the manual, 0 to 1023 from robots; nothing is converted here."""

from __future__ import annotations

from roboglot.clients.robomaster.calls import Chapter, on_off


class SensorAdapter(Chapter):
    """``client.sensor_adapter``. Adapters 1 to 6 have inputs 1 and 2."""

    async def get_adc(self, id: int, port: int) -> float:
        """Return the voltage, V; real robots: 0 to 1023 (3.2.10.1)."""
        return await self._number("sensor_adapter adc", id=id, port=port)

    async def get_io_level(self, id: int, port: int) -> int:
        """Return the logic level, 0 or 1 (3.2.10.2)."""
        return round(await self._number("sensor_adapter io_level", id=id, port=port))

    async def get_pulse_period(self, id: int, port: int) -> int:
        """Return the time between the last two changes of level, ms (3.2.10.3)."""
        return round(await self._number("sensor_adapter pulse_period", id=id, port=port))

    async def event(self, io_level: bool) -> None:
        """Switch AdapterLevel on or off (3.2.10.4)."""
        await self._do("sensor_adapter event", io_level=on_off(io_level))
