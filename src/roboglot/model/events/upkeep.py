"""Events of faults, devices, members and software."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.model.events.stream import Event
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.model.components.system.bluetooth import BluetoothDevice
    from roboglot.model.components.system.fault import Fault
    from roboglot.model.components.system.firmware import FirmwareProgress
    from roboglot.model.components.system.link_state import LinkState
    from roboglot.model.components.system.network import NetworkState


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultRaised(Event):
    """A fault began."""

    fault: Fault


@dataclass(frozen=True, slots=True, kw_only=True)
class FaultCleared(Event):
    """A fault ended, or was dismissed."""

    fault: Fault


@dataclass(frozen=True, slots=True, kw_only=True)
class BluetoothConnected(Event):
    """The device is connected; ``again``: by itself, after it had been lost."""

    device: BluetoothDevice
    again: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class BluetoothLost(Event):
    """The device went out of range or off, without a request."""

    device: BluetoothDevice


@dataclass(frozen=True, slots=True, kw_only=True)
class GearChanged(Event):
    """The speed gear was changed on the remote control (a ``Gear`` value)."""

    gear: int


@dataclass(frozen=True, slots=True, kw_only=True)
class MembersChanged(Event):
    """A member was added, renamed, removed, or has another face or voice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class NetworkChanged(Event):
    """The Wi-Fi card joined, lost, left or became a network, or the internet came or went."""

    state: NetworkState


@dataclass(frozen=True, slots=True, kw_only=True)
class FirmwareChanged(Event):
    """An update advanced by a percent or reached another state."""

    progress: FirmwareProgress


@dataclass(frozen=True, slots=True, kw_only=True)
class DiskLow(Event):
    """Little storage space is left, bytes."""

    free: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlChanged(Event):
    """Another client moves the robot (``holder``, empty: none now), or control was taken or released."""

    holder: str
    taken_by: str


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlRefused(Event):
    """``client`` may not move the robot, or was stopped, because another has control (``reason``)."""

    client: str
    doing: str
    reason: str


@dataclass(frozen=True, slots=True, kw_only=True)
class LinkChanged(Event):
    """The link to the real robot came, went, or another client moves the robot now (``holder``)."""

    state: LinkState
    holder: str
