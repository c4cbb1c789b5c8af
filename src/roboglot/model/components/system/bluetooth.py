"""Bluetooth low energy: devices around the robot, and the one that it is connected to."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

from roboglot.model.action import Action
from roboglot.model.components.component import Component

BLUETOOTH = "bluetooth"  # the resource of scanning, connecting and updating
SCAN_SECONDS_MAX = 60.0


class DeviceKind(StrEnum):
    """Kind of a Bluetooth device as it reports it."""

    UNKNOWN = "unknown"
    BRACELET = "bracelet"  # also a remote control; carries a UWB tag
    DOCK = "dock"


@dataclass(frozen=True, slots=True)
class BluetoothDevice:
    """A device as the radio knows it. ``signal`` in dBm as heard last; ``random``: its address changes now and then.

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

    A connection that was lost (out of reach, battery empty) comes back by itself when the device is heard again.
    """

    @property
    @abstractmethod
    def connected(self) -> BluetoothDevice | None:
        """The device, with fresh values; None while there is none or it is out of reach."""

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
        """A newer firmware version for the connected device; "" if there is none."""

    @abstractmethod
    def scan(self, seconds: float, *, source: str = "") -> Action:
        """Listen for ``seconds`` (at most SCAN_SECONDS_MAX); ``found`` has the outcome. Raises InvalidGoal."""

    @abstractmethod
    def connect(self, address: str, *, source: str = "") -> Action:
        """Connect, instead of the present device; aborts with NotFound when it is not heard. Takes some seconds."""

    @abstractmethod
    async def disconnect(self) -> None:
        """Let go of the device; raises Refused without one."""

    @abstractmethod
    async def forget(self, address: str | None) -> None:
        """Strike a device, or all but the connected one (None), from the history; NotFound if it is not there."""

    @abstractmethod
    def update_device(self, *, source: str = "") -> Action:
        """Bring the newer firmware to the device; feedback is 0..1. Aborts with Refused (no device, no newer one, its
        battery below a third) or Blocked (lost on the way).
        """
