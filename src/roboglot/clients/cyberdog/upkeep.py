"""Chapters "status", "ota", "bluetooth", "low power", "developer" and the rest: 1001, 5001 to 5006, 8001 to 55001."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import aclosing
from typing import Any

import msgspec

from roboglot.clients.cyberdog.calls import Calls, CyberDogRefused, check
from roboglot.clients.cyberdog.values import Device, UpdateProgress, UpdateStatus
from roboglot.clients.errors import LinkLost
from roboglot.wire.cyberdog.codes import Accepted, Code

TOPICS = (
    "version", "sn", "nick_name", "volume", "mic_state", "voice_control", "wifi", "bat_info", "motor_temper",
    "audio_state", "device_model", "stand", "lowpower_control",
)  # fmt: skip


OnUpdate = Callable[[str, float], object]  # the state, and how much of it is done, 0..1


class _Devices(msgspec.Struct):
    device_info_list: list[Device]


class _Data(msgspec.Struct):
    data: int


class _Time(msgspec.Struct):
    time: int


class _Firmware(msgspec.Struct):
    success: bool
    message: str = ""


class _Battery(msgspec.Struct):
    connected: bool
    persentage: float = 0.0


class Upkeep(Calls):
    """Maintenance of the machine: status, updates, Bluetooth, power, developer access."""

    async def information(self, *topics: str, uid: str = "") -> Mapping[str, Any]:
        """1001: what is asked for of TOPICS (all, if none is named), in the robot's own form."""
        asked = {f"is_{topic}": True for topic in topics or TOPICS}
        return await self.ask(Code.DEVICE_INFO, dict[str, Any], {**asked, "uid": uid})

    async def status(self) -> Mapping[str, Any]:
        """10001: the states of the heartbeat."""
        return await self.ask(Code.STATUS, dict[str, Any])

    async def update_status(self) -> UpdateStatus:
        """5001."""
        return await self.ask(Code.UPDATE_STATUS, UpdateStatus)

    async def download_update(self, modules: Sequence[Mapping[str, object]]) -> None:
        """5003: as the maker's server describes them; UpdateProgress is pushed."""
        await self.do(Code.DOWNLOAD_UPDATE, {"modules": modules})

    async def install_update(self, md5: str) -> None:
        """5004: UpdateProgress, UpdateReboots and UpdateResult are pushed."""
        await self.do(Code.INSTALL_UPDATE, {"md5": md5})

    async def update_progress(self) -> UpdateProgress:
        """5005."""
        return await self.ask(Code.UPDATE_PROGRESS, UpdateProgress)

    async def update_time(self) -> int:
        """5006: s; below 0: not known."""
        return (await self.ask(Code.UPDATE_TIME, _Time)).time

    async def update(self, operate: str, data: object = None, on_feedback: OnUpdate | None = None) -> Mapping[str, Any]:
        """5010: "inquire", "download", "upgrade" and what else the robot knows; ``data`` of the result.

        Raises CyberDogRefused when it is not accepted (2), and with the result's code when it failed.
        """
        return await self._goal(Code.START_UPDATE, {"operate": operate, "data": data}, on_feedback)

    async def join_update(self, on_feedback: OnUpdate | None = None) -> Mapping[str, object]:
        """5011: the goal under way, from its latest feedback on. Raises CyberDogRefused (3) when there is none."""
        return await self._goal(Code.JOIN_UPDATE, {}, on_feedback)

    async def _goal(self, code: Code, params: dict[str, object], on_feedback: OnUpdate | None) -> Mapping[str, object]:
        async with aclosing(self.parts(code, dict[str, Any], params)) as answers:
            async for answer in answers:
                if answer.get("accepted", Accepted.YES) != Accepted.YES:
                    raise CyberDogRefused(code.name, int(answer["accepted"]), "not accepted")
                if "code" in answer:
                    check(code, {"result": answer["code"], "message": answer.get("message", "")})
                    return dict(answer.get("data") or {})
                if on_feedback and "state" in answer:
                    on_feedback(str(answer["state"]), float(answer.get("progress", 0)) / 100)
        raise LinkLost(f"{code.name}: the stream ended without a result")

    async def scan_bluetooth(self, seconds: float) -> Sequence[Device]:
        """8001: what is heard within that time."""
        within = max(6.0, 1.5 * seconds) + 5.0
        return (await self._devices(Code.SCAN_BLUETOOTH, {"scan_seconds": float(seconds)}, within)).device_info_list

    async def bluetooth_history(self) -> Sequence[Device]:
        """8001 without a scan: those that were connected once."""
        return (await self._devices(Code.SCAN_BLUETOOTH, {"scan_seconds": 0.0}, 10.0)).device_info_list

    async def connect_bluetooth(self, device: Device) -> None:
        """8002."""
        wanted = {"mac": device.mac, "addr_type": device.addr_type, "name": device.name}
        await self.do(Code.CONNECT_BLUETOOTH, {"selected_device": wanted}, within=23.0)

    async def disconnect_bluetooth(self) -> None:
        """8002 without a device."""
        await self.do(Code.CONNECT_BLUETOOTH, {}, within=23.0)

    async def bluetooth_connected(self) -> Sequence[Device]:
        """8004."""
        return (await self._devices(Code.BLUETOOTH_CONNECTED, None, 10.0)).device_info_list

    async def bluetooth_firmware(self) -> str | None:
        """8005: None while nothing is connected."""
        reply = await self.ask(Code.BLUETOOTH_FIRMWARE, _Firmware)
        return reply.message if reply.success else None

    async def bluetooth_battery(self) -> float | None:
        """8006: 0..1; None while nothing is connected."""
        reply = await self.ask(Code.BLUETOOTH_BATTERY, _Battery)
        return reply.persentage if reply.connected else None

    async def forget_bluetooth(self, mac: str | None = None) -> None:
        """8007: that one, or all."""
        await self.do(Code.FORGET_BLUETOOTH, {} if mac is None else {"mac": mac})

    async def update_bluetooth(self) -> None:
        """8009: BluetoothUpdateProgress is pushed."""
        await self.do(Code.UPDATE_BLUETOOTH, within=15.0)

    async def set_gear(self, gear: int) -> None:
        """8011: 0 slow, 1 middle, 2 fast."""
        await self.text(Code.SET_GEAR, {"data": gear})

    async def gear(self) -> int:
        """8013."""
        return (await self.ask(Code.GEAR, _Data)).data

    async def unlock(self, link: str) -> None:
        """9030: developers' access by the key at ``link``."""
        await self.do(Code.UNLOCK, {"httplink": link}, within=15.0)

    async def reboot(self) -> None:
        """9031."""
        await self.do(Code.REBOOT)

    async def leave_low_power(self) -> None:
        """10002."""
        await self.do(Code.LEAVE_LOW_POWER, within=15.0)

    async def set_automatic_low_power(self, on: bool) -> None:
        """10003."""
        await self.do(Code.AUTOMATIC_LOW_POWER, {"data": on})

    async def set_work_environment(self, environment: str) -> None:
        """10004: "pro" or "test"."""
        await self.do(Code.WORK_ENVIRONMENT, {"data": environment})

    async def upload_log(self) -> None:
        """10005."""
        await self.do(Code.UPLOAD_LOG, within=65.0)

    async def power_off(self) -> None:
        """10006."""
        await self.do(Code.POWER_OFF)

    async def calibrate_legs(self, power: bool) -> None:
        """12001: False lies down and lets the motors go; true gives power and stands."""
        await self.do(Code.CALIBRATE_LEGS, {"data": power}, within=15.0)

    async def disconnect_app(self) -> None:
        """55001: the robot forgets this app until its next request."""
        await self.text(Code.DISCONNECT_APP)

    async def _devices(self, code: Code, params: object, within: float) -> _Devices:
        return await self.ask(code, _Devices, params, within=within)
