"""Bluetooth: receives the world's gadgets through walls and slabs, keeps one connection, updates the device."""

from __future__ import annotations

import asyncio
import dataclasses
from collections.abc import Callable, Sequence
from typing import Annotated, Any

from msgspec import Meta, Struct

from roboglot.model.actions import Action
from roboglot.model.components.system.bluetooth import (
    BLUETOOTH,
    SCAN_SECONDS_MAX,
    Bluetooth,
    BluetoothDevice,
    DeviceKind,
    DeviceUpdate,
    DeviceUpdateStage,
)
from roboglot.model.components.system.settings import Settings
from roboglot.model.errors import Blocked, InvalidGoal, NotFound, Refused
from roboglot.model.events import BluetoothConnected, BluetoothLost
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.radio.gadgets import GadgetInWorld, Gadgets

HISTORY_MAX = 50
KEY = "bluetooth.history"
LOOK = 0.5  # s between checks of the connection
STAGES = {  # of a device's update: s that each takes
    DeviceUpdateStage.UNPACKING: 1.0,
    DeviceUpdateStage.STARTING: 1.0,
    DeviceUpdateStage.SENDING: 16.0,
    DeviceUpdateStage.RESTARTING: 2.0,
}
UPDATE_SECONDS = sum(STAGES.values())
UPDATE_PERIOD = 0.2  # s between two reports of its progress
UPDATE_BATTERY = 1 / 3


class BluetoothSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``sensitivity``: weakest signal that is received, dBm; ``connect_time`` in s."""

    sensitivity: Annotated[float, Meta(ge=-120, le=0)] = -92.0
    connect_time: NotNegative = 2.0


class SimulatedBluetooth(Bluetooth):
    """Bluetooth with its history in the robot's settings."""

    def __init__(self, section: BluetoothSection, hull: Hull, gadgets: Gadgets, robot: Robot) -> None:
        self._section, self._hull, self._gadgets, self._robot = section, hull, gadgets, robot
        self._wanted: GadgetInWorld | None = None  # the device that people paired
        self._linked = False  # and whether it is in range
        self._found: tuple[BluetoothDevice, ...] = ()
        self._remembered: list[BluetoothDevice] | None = None
        self._turn = asyncio.Lock()  # of changes of the history
        self._next = 0.0

    @property
    def connected(self) -> BluetoothDevice | None:
        return self._described(self._wanted) if self._wanted and self._linked else None

    @property
    def gadget(self) -> GadgetInWorld | None:
        """The connected gadget in the world, for components that range it by another radio; None: none."""
        return self._wanted if self._linked else None

    @property
    def history(self) -> Sequence[BluetoothDevice]:
        if self._remembered is None:
            rows = self._robot[Settings].get(KEY, []) if Settings in self._robot else []
            self._remembered = [_read(row) for row in rows]
        return tuple(self._remembered)

    @property
    def found(self) -> Sequence[BluetoothDevice]:
        return self._found

    @property
    def update_available(self) -> str:
        gadget = self.gadget
        return gadget.gadget.newest if gadget and gadget.gadget.newest != gadget.firmware else ""

    def scan(self, seconds: float, *, source: str = "") -> Action:
        if not 0.0 < seconds <= SCAN_SECONDS_MAX:
            raise InvalidGoal(f"a scan takes up to {SCAN_SECONDS_MAX:g} s")

        async def run(_action: Action) -> None:
            heard: dict[str, BluetoothDevice] = {}
            end = self._robot.clock.time() + seconds
            while True:
                for gadget in self._gadgets.all():
                    if gadget.gadget.name and self._hears(gadget):
                        heard[gadget.gadget.address] = self._advertised(gadget)
                left = end - self._robot.clock.time()
                if left <= 0.0:
                    break
                await self._robot.clock.sleep(min(LOOK, left))
            self._found = tuple(sorted(heard.values(), key=lambda device: -device.signal))

        return self._robot.actions.start("bluetooth scan", run, resources=[BLUETOOTH], goal=seconds, source=source)

    def connect(self, address: str, *, source: str = "") -> Action:
        async def run(_action: Action) -> None:
            gadget = self._gadgets.get(address)
            self._wanted, self._linked = None, False
            await self._robot.clock.sleep(self._section.connect_time)
            if not self._hears(gadget):
                raise NotFound(f"{address} is out of radio range")
            device = self._described(gadget)
            await self._remember(lambda known: [device, *(other for other in known if other.address != address)])
            self._wanted, self._linked = gadget, True
            self._robot.events.publish(BluetoothConnected(stamp=self._robot.clock.time(), device=device))

        return self._robot.actions.start("bluetooth connect", run, resources=[BLUETOOTH], goal=address, source=source)

    async def disconnect(self) -> None:
        if self._wanted is None:
            raise Refused("no device is connected")
        await self._robot.actions.cancel(resource=BLUETOOTH, reason="the device is released")
        self._wanted, self._linked = None, False

    async def forget(self, address: str | None) -> None:
        def edit(known: Sequence[BluetoothDevice]) -> list[BluetoothDevice]:
            if address is None:
                keep = self._wanted.gadget.address if self._wanted else None
                return [device for device in known if device.address == keep]
            if all(device.address != address for device in known):
                raise NotFound(f"{address} was never connected")
            return [device for device in known if device.address != address]

        await self._remember(edit)

    def update_device(self, *, source: str = "") -> Action:
        async def run(action: Action) -> None:
            gadget, newest = self.gadget, self.update_available
            if gadget is None or not newest:
                raise Refused("no device can be updated")
            if gadget.battery < UPDATE_BATTERY:
                raise Refused("the device's battery is too low for an update")
            passed = 0.0
            for stage, seconds in STAGES.items():
                for _ in range(round(seconds / UPDATE_PERIOD)):
                    action.report(DeviceUpdate(stage, passed / UPDATE_SECONDS))
                    await self._robot.clock.sleep(UPDATE_PERIOD)
                    passed += UPDATE_PERIOD
                    if self.gadget is not gadget:
                        raise Blocked("the device was lost during its update")
            gadget.firmware = newest

        return self._robot.actions.start("bluetooth update", run, resources=[BLUETOOTH], source=source)

    def sense(self, stamp: float, _seconds: float) -> None:
        """Check periodically whether the device is in range."""
        if self._wanted is None or stamp < self._next:
            return
        self._next = stamp + LOOK
        heard = self._hears(self._wanted)
        if heard == self._linked:
            return
        self._linked = heard
        device = self._described(self._wanted)
        if heard:
            self._robot.events.publish(BluetoothConnected(stamp=stamp, device=device, again=True))
        else:
            self._robot.events.publish(BluetoothLost(stamp=stamp, device=device))

    async def _remember(self, edit: Callable[[Sequence[BluetoothDevice]], list[BluetoothDevice]]) -> None:
        """Replace the known devices by ``edit`` of them, once that is stored."""
        async with self._turn:
            devices = edit(self.history)[:HISTORY_MAX]
            if Settings in self._robot:
                await self._robot[Settings].put(KEY, [dataclasses.asdict(device) for device in devices])
            self._remembered = devices

    def _hears(self, gadget: GadgetInWorld) -> bool:
        return self._signal(gadget) >= self._section.sensitivity

    def _signal(self, gadget: GadgetInWorld) -> float:
        return self._gadgets.signal(gadget, self._hull.pose.point, self._hull.floor)

    def _advertised(self, gadget: GadgetInWorld) -> BluetoothDevice:
        """Return the gadget as advertised, with the stored details of a known one."""
        heard = BluetoothDevice(
            gadget.gadget.address, gadget.gadget.name, gadget.gadget.random, round(self._signal(gadget), 1)
        )
        known = next((device for device in self.history if device.address == heard.address), None)
        return heard if known is None else dataclasses.replace(known, signal=heard.signal)

    def _described(self, gadget: GadgetInWorld) -> BluetoothDevice:
        """Return everything that a connected device reports."""
        return dataclasses.replace(
            self._advertised(gadget),
            kind=DeviceKind(gadget.gadget.kind),
            firmware=gadget.firmware,
            battery=gadget.battery,
        )


def _read(row: dict[str, Any]) -> BluetoothDevice:
    return BluetoothDevice(**{**row, "kind": DeviceKind(row["kind"])})


def _fit(fit: Fitting) -> SimulatedBluetooth:
    return SimulatedBluetooth(fit.body[BluetoothSection], fit.hull, fit.world.gadgets, fit.robot)


PART = Part(
    name="bluetooth",
    interface=Bluetooth,
    section=BluetoothSection,
    fit=_fit,
    after=("health",),
    sense=SimulatedBluetooth.sense,
    every=5,
    first=5,
)
