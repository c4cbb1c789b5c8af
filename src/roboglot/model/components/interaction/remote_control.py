"""The handheld or wrist-worn remote control: its speed gear. Its stick drives the robot directly."""

from __future__ import annotations

from abc import abstractmethod
from enum import IntEnum

from roboglot.model.components.component import Component

REMOTE = "remote control"  # the source of actions that its sticks command


class Gear(IntEnum):
    """Speed range of the remote control's stick."""

    LOW = 0
    MIDDLE = 1
    HIGH = 2


class RemoteControl(Component):
    """Reached over Bluetooth; publishes ``GearChanged`` when the gear is changed on the device."""

    @property
    @abstractmethod
    def gear(self) -> Gear:
        """Current gear, valid even while no device is connected."""

    @abstractmethod
    async def set_gear(self, gear: Gear) -> None:
        """Set the gear from the robot; returns once it is on disk."""
