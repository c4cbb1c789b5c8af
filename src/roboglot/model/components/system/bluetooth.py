"""Bluetooth low energy: devices around the robot, and the one that it is connected to."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component
from roboglot.values import dataclass

BLUETOOTH = "bluetooth"  # the resource of scanning, connecting and updating
SCAN_SECONDS_MAX = 60.0


class DeviceKind(StrEnum):
    """Kind of a Bluetooth device as it reports it."""

    UNKNOWN = "unknown"
    BRACELET = "bracelet"  # also a remote control; carries a UWB tag
    DOCK = "dock"


class DeviceUpdateStage(StrEnum):
    """Stage of a device's firmware update, in their order."""

    UNPACKING = "unpacking"
    STARTING = "starting"  # the device is asked to take it
    SENDING = "sending"
    RESTARTING = "restarting"  # the device writes it, and is waited for


@dataclass(frozen=True, slots=True)
class DeviceUpdate:
    """Progress of a device's firmware update; ``share`` of the whole, 0..1."""

    stage: DeviceUpdateStage
    share: float


@dataclass(frozen=True, slots=True)
class BluetoothDevice:
    """A device as the radio knows it. ``signal``: last one received, dBm; ``random``: its address changes now and then.

    ``kind``, ``firmware`` and ``battery`` (0..1) are known only of a device that was connected once.
    """

    address: str
    name: str
    random: bool = False
    signal: float = -100.0
    kind: DeviceKind = DeviceKind.UNKNOWN
    firmware: str = ""
    battery: float | None = None


class Bluetooth(Component):
    """One connection at a time. Publishes ``BluetoothConnected`` and ``BluetoothLost``.

    A lost connection (out of range, battery empty) is restored when the device is received again.
    """

    @property
    @abstractmethod
    def connected(self) -> BluetoothDevice | None:
        """Connected device with current values; None without one, or while it is out of range."""

    @property
    @abstractmethod
    def history(self) -> Sequence[BluetoothDevice]:
        """Devices that were connected once, the latest first."""

    @property
    @abstractmethod
    def found(self) -> Sequence[BluetoothDevice]:
        """Devices found by the last scan, strongest first; devices without a name are left out."""

    @property
    @abstractmethod
    def update_available(self) -> str:
        """Newer firmware version for the connected device; "" if there is none."""

    @abstractmethod
    def scan(self, seconds: float, *, source: str = "") -> Action:
        """Listen for ``seconds`` (at most SCAN_SECONDS_MAX); ``found`` has the outcome. Raises InvalidGoal."""

    @abstractmethod
    def connect(self, address: str, *, source: str = "") -> Action:
        """Connect to a device in place of the current one; takes some seconds, aborts with NotFound out of range."""

    @abstractmethod
    async def disconnect(self) -> None:
        """Disconnect; raises Refused without a device."""

    @abstractmethod
    async def forget(self, address: str | None) -> None:
        """Delete a device, or all but the connected one (None), from the history. Raises NotFound."""

    @abstractmethod
    def update_device(self, *, source: str = "") -> Action:
        """Update the device's firmware; feedback is ``DeviceUpdate``. Aborts with Refused (no device, no update, device
        battery below a third) or Blocked (connection lost); the last feedback then has the stage that failed.
        """
