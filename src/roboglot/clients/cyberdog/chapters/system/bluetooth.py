"""Chapter "bluetooth": 8001 to 8013."""

from __future__ import annotations

from collections.abc import Sequence

import msgspec

from roboglot.clients.cyberdog.calls import Calls
from roboglot.clients.cyberdog.values import Device
from roboglot.wire.cyberdog.codes import Code


class _Devices(msgspec.Struct):
    device_info_list: list[Device]


class _Data(msgspec.Struct):
    data: int


class _Firmware(msgspec.Struct):
    success: bool
    message: str = ""


class _Battery(msgspec.Struct):
    connected: bool
    persentage: float = 0.0


class Bluetooth(Calls):
    """The bracelet and other devices."""

    async def scan_bluetooth(self, seconds: float) -> Sequence[Device]:
        """8001: return the devices found within that time."""
        within = max(6.0, 1.5 * seconds) + 5.0
        return (await self._devices(Code.SCAN_BLUETOOTH, {"scan_seconds": float(seconds)}, within)).device_info_list

    async def bluetooth_history(self) -> Sequence[Device]:
        """8001 without a scan: return the devices of earlier connections."""
        return (await self._devices(Code.SCAN_BLUETOOTH, {"scan_seconds": 0.0}, 10.0)).device_info_list

    async def connect_bluetooth(self, device: Device) -> None:
        """8002: connect a device."""
        wanted = {"mac": device.mac, "addr_type": device.addr_type, "name": device.name}
        await self.do(Code.CONNECT_BLUETOOTH, {"selected_device": wanted}, within=23.0)

    async def disconnect_bluetooth(self) -> None:
        """8002 without a device: disconnect."""
        await self.do(Code.CONNECT_BLUETOOTH, {}, within=23.0)

    async def bluetooth_connected(self) -> Sequence[Device]:
        """8004: return the connected devices."""
        return (await self._devices(Code.BLUETOOTH_CONNECTED, None, 10.0)).device_info_list

    async def bluetooth_firmware(self) -> str | None:
        """8005: return the version of a device's firmware; None while nothing is connected."""
        reply = await self.ask(Code.BLUETOOTH_FIRMWARE, _Firmware)
        return reply.message if reply.success else None

    async def bluetooth_battery(self) -> float | None:
        """8006: return a device's charge, 0..1; None while nothing is connected."""
        reply = await self.ask(Code.BLUETOOTH_BATTERY, _Battery)
        return reply.persentage if reply.connected else None

    async def forget_bluetooth(self, mac: str | None = None) -> None:
        """8007: forget one device, or all."""
        await self.do(Code.FORGET_BLUETOOTH, {} if mac is None else {"mac": mac})

    async def update_bluetooth(self) -> None:
        """8009: update a device's firmware; the progress is pushed (BluetoothUpdateProgress)."""
        await self.do(Code.UPDATE_BLUETOOTH, within=15.0)

    async def set_gear(self, gear: int) -> None:
        """8011: set the gear of the bracelet's stick: 0 slow, 1 middle, 2 fast."""
        await self.text(Code.SET_GEAR, {"data": gear})

    async def gear(self) -> int:
        """8013: return the gear of the bracelet's stick."""
        return (await self.ask(Code.GEAR, _Data)).data

    async def _devices(self, code: Code, params: object, within: float) -> _Devices:
        return await self.ask(code, _Devices, params, within=within)
