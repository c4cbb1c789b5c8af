"""Chapter "bluetooth": scan, connect, forget, firmware and gear of the bracelet (8001 to 8013)."""

from __future__ import annotations

from collections.abc import Iterable

import msgspec

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.interaction.remote_control import Gear, RemoteControl
from roboglot.model.components.system.bluetooth import (
    BLUETOOTH,
    SCAN_SECONDS_MAX,
    Bluetooth,
    BluetoothDevice,
    DeviceKind,
)
from roboglot.model.errors import NotFound, Refused
from roboglot.model.robot import Robot
from roboglot.operations import BadParameters, Right
from roboglot.protocols.cyberdog.call import Call
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE
from roboglot.protocols.cyberdog.chapters.system.bracelet import LEFT
from roboglot.protocols.cyberdog.table import TABLE
from roboglot.validation import why_invalid
from roboglot.wire.cyberdog.codes import Code, InBandError

CONNECT_MAX = 18.0  # s
KINDS = {DeviceKind.UNKNOWN: 0, DeviceKind.BRACELET: 16, DeviceKind.DOCK: 17}
DONE, RADIO_FAILED, NOT_CONNECTED = 0, 1, 3  # ``result`` of 8002


class WireDevice(msgspec.Struct):
    """Address and name of a device to connect."""

    mac: str
    addr_type: str
    name: str


@TABLE.on(Code.SCAN_BLUETOOTH, right=Right.EDIT, needs=(Bluetooth,))
async def scan(call: Call, *, scan_seconds: float = 0.0) -> dict[str, object]:
    """Return new devices found in ``scan_seconds``; 0: devices connected before.

    While a device is connected, the last scan's whole list is returned. A scan ends when the last app that waits for
    it has gone.
    """
    radio = call.context.robot[Bluetooth]
    here = radio.connected.address if radio.connected else ""
    if scan_seconds <= 0.0:
        return _listed(device for device in radio.history if device.address != here)
    if not here:
        scanning = _under_way(call.context.robot) or radio.scan(min(scan_seconds, SCAN_SECONDS_MAX), source=SOURCE)
        try:
            with call.context.bracelet.waiting_for(scanning):
                await call.context.robot.clock.wait_for(scanning.succeeded(), max(6.0, 1.5 * scan_seconds))
        except TimeoutError:
            return {"error_code": int(InBandError.TIMEOUT)}
    known = set() if here else {device.address for device in radio.history}
    return _listed(device for device in radio.found if device.address not in known)


def _under_way(robot: Robot) -> Action | None:
    """Return the running scan of another request, which later requests join."""
    return next((action for action in robot.actions.running(BLUETOOTH) if isinstance(action.goal, float)), None)


@TABLE.on(Code.CONNECT_BLUETOOTH, right=Right.EDIT, needs=(Bluetooth,))
async def connect(call: Call, *, selected_device: object = None) -> dict[str, int]:
    """Connect a device (0, or 1: no answer); without one, disconnect the current device (0, or 3: none).

    An attempt ends with its request.
    """
    robot = call.context.robot
    radio = robot[Bluetooth]
    if selected_device is None:
        try:
            await radio.disconnect()
        except Refused as error:
            return call.refused({"result": NOT_CONNECTED}, str(error))
        return {"result": DONE}
    try:
        device = msgspec.convert(selected_device, WireDevice)
    except msgspec.ValidationError as error:
        raise BadParameters(why_invalid(error, field="selected_device", wanted=WireDevice)) from None
    connecting = radio.connect(device.mac, source=SOURCE)
    try:
        status = await robot.clock.wait_for(connecting.done(), CONNECT_MAX)
    except TimeoutError:
        return {"error_code": int(InBandError.TIMEOUT)}
    finally:
        connecting.cancel(LEFT)
    if status is not ActionStatus.SUCCEEDED:
        return call.refused({"result": RADIO_FAILED}, connecting.reason)
    return {"result": DONE}


@TABLE.on(Code.BLUETOOTH_CONNECTED, right=Right.SEE, needs=(Bluetooth,))
async def connected(call: Call) -> dict[str, object]:
    """Return the connected device, as a list of none or one."""
    device = call.context.robot[Bluetooth].connected
    return _listed([device] if device else [])


@TABLE.on(Code.BLUETOOTH_FIRMWARE, right=Right.SEE, needs=(Bluetooth,))
async def firmware_version(call: Call) -> dict[str, object]:
    """Return the firmware version of the connected device."""
    device = call.context.robot[Bluetooth].connected
    return {"success": device is not None, "message": device.firmware if device else ""}


@TABLE.on(Code.BLUETOOTH_BATTERY, right=Right.SEE, needs=(Bluetooth,))
async def battery_level(call: Call) -> dict[str, object]:
    """Return the device's battery, 0 to 1; key and type are the manual's."""
    device = call.context.robot[Bluetooth].connected
    return {"connected": device is not None, "persentage": (device.battery or 0.0) if device else 0.0}


@TABLE.on(Code.FORGET_BLUETOOTH, right=Right.EDIT, needs=(Bluetooth,))
async def forget(call: Call, *, mac: object = "") -> dict[str, bool]:
    """Delete a device from the history; without ``mac``, all but the connected one."""
    if not isinstance(mac, str):  # taken as absent, it would delete them all
        raise BadParameters("mac must be a text")
    try:
        await call.context.robot[Bluetooth].forget(mac or None)
    except NotFound as error:
        return call.refused({"success": False}, str(error))
    return {"success": True}


@TABLE.on(Code.UPDATE_BLUETOOTH, right=Right.ADMIN, needs=(Bluetooth,))
async def update_device(call: Call) -> dict[str, object]:
    """Start the firmware update of the connected device; push 8010 reports the progress."""
    radio = call.context.robot[Bluetooth]
    if radio.connected is None:
        return {"success": False, "message": "no device is connected"}
    if not radio.update_available:
        return {"success": False, "message": "there is no newer firmware"}
    if call.context.bracelet.updating:
        return {"success": False, "message": "an update is under way"}
    call.context.bracelet.follow(radio.update_device(source=SOURCE))
    return {"success": True, "message": ""}


@TABLE.on(Code.SET_GEAR, right=Right.EDIT, needs=(RemoteControl,))
async def set_gear(call: Call, *, data: int) -> str:
    """Set the gear of the remote control's stick: 0 low, 1 middle, 2 high; anything else is refused."""
    if data not in list(Gear):
        raise BadParameters("a gear must be 0, 1 or 2")
    await call.context.robot[RemoteControl].set_gear(Gear(data))
    return ""


@TABLE.on(Code.GEAR, right=Right.SEE, needs=(RemoteControl,))
async def gear(call: Call) -> dict[str, int]:
    """Return the current gear."""
    return {"data": int(call.context.robot[RemoteControl].gear)}


def _listed(devices: Iterable[BluetoothDevice]) -> dict[str, object]:
    return {"device_info_list": [_device(device) for device in devices]}


def _device(device: BluetoothDevice) -> dict[str, object]:
    return {
        "mac": device.address,
        "name": device.name,
        "addr_type": "random" if device.random else "public",
        "device_type": KINDS[device.kind],
        "firmware_version": device.firmware,
        "battery_level": device.battery or 0.0,
    }
