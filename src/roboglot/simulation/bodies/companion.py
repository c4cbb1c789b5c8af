"""Gives a robot what makes it a companion: what it feels, whom it talks to by radio, its firmware and power modes."""

from __future__ import annotations

from typing import TypeVar

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.remote_control import RemoteControl
from roboglot.model.components.logistics.traffic_radio import TrafficRadio
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.sensing.gps import Gps
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.components.sensing.touch import Touch, TouchKind
from roboglot.model.components.sensing.ultra_wideband import UltraWideband
from roboglot.model.components.system.bluetooth import Bluetooth
from roboglot.model.components.system.developer import Developer
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.system_log import SystemLog
from roboglot.model.errors import ComponentMissing
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.components.energy.power import SimulatedPower
from roboglot.simulation.components.interaction.remote_control import SimulatedRemoteControl
from roboglot.simulation.components.logistics.traffic_radio import SimulatedTrafficRadio
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.legs import SimulatedLegs
from roboglot.simulation.components.motion.motors import SimulatedMotors
from roboglot.simulation.components.sensing.gps import SimulatedGps
from roboglot.simulation.components.sensing.lidar import SimulatedLidar
from roboglot.simulation.components.sensing.time_of_flight import SimulatedTimeOfFlight
from roboglot.simulation.components.sensing.touch import SimulatedTouch
from roboglot.simulation.components.sensing.ultra_wideband import SimulatedUltraWideband
from roboglot.simulation.components.system.bluetooth import SimulatedBluetooth
from roboglot.simulation.components.system.developer import SimulatedDeveloper
from roboglot.simulation.components.system.firmware import SimulatedFirmware
from roboglot.simulation.components.system.system_log import SimulatedSystemLog
from roboglot.simulation.radio.gadgets import Gadgets
from roboglot.simulation.world.description import WorldDescription
from roboglot.simulation.world.randomness import stream
from roboglot.simulation.world.rays import Rays

PERIOD = 0.1  # s
P = TypeVar("P", bound=Component)


class Companion:
    """Those parts that the robot's body has."""

    def __init__(
        self, robot: Robot, hull: Hull, world: WorldDescription, rays: Rays, gadgets: Gadgets, seed: int
    ) -> None:
        body, clock = hull.body, robot.clock
        base = _simulated(robot, Base, SimulatedBase)
        assert base
        self._since = 0.0
        self._battery = _simulated(robot, Battery, SimulatedBattery)
        self._touch = SimulatedTouch(robot) if body.touch else None
        self._gps: SimulatedGps | None = None
        if body.gps:
            self._gps = SimulatedGps(body.gps, hull, world, clock, stream(seed, robot.id, "gps"))
        self._motors = SimulatedMotors(body.motors, hull, stream(seed, robot.id, "motors")) if body.motors else None
        self._bluetooth = SimulatedBluetooth(body.bluetooth, hull, gadgets, robot) if body.bluetooth else None
        self._remote = SimulatedRemoteControl(robot, self._bluetooth) if self._bluetooth else None
        self._firmware = SimulatedFirmware(body.firmware, robot, base) if body.firmware else None
        self._power: SimulatedPower | None = None
        if body.power:
            legs, lidar = _simulated(robot, Legs, SimulatedLegs), _simulated(robot, Lidar, SimulatedLidar)
            self._power = SimulatedPower(body.power, robot, base, legs, self._battery, lidar)
        if body.firmware:
            robot.add(SystemLog, SimulatedSystemLog(robot))
            robot.add(Developer, SimulatedDeveloper(robot))
        if body.traffic_radio:
            robot.add(TrafficRadio, SimulatedTrafficRadio(body.traffic_radio, hull, gadgets.radio.traffic))
        if body.time_of_flight:
            chance = stream(seed, robot.id, "time of flight")
            robot.add(TimeOfFlight, SimulatedTimeOfFlight(body.time_of_flight, hull, rays, clock, chance))
        if body.ultra_wideband and self._bluetooth:
            chance = stream(seed, robot.id, "ultra-wideband")
            ranging = SimulatedUltraWideband(body.ultra_wideband, hull, self._bluetooth, gadgets, clock, chance)
            robot.add(UltraWideband, ranging)
        parts: tuple[tuple[type[Component], Component | None], ...] = (
            (Touch, self._touch),
            (Gps, self._gps),
            (Motors, self._motors),
            (Bluetooth, self._bluetooth),
            (RemoteControl, self._remote),
            (Firmware, self._firmware),
            (Power, self._power),
        )
        for interface, part in parts:
            if part is not None:
                robot.add(interface, part)

    def sense(self, stamp: float, seconds: float) -> None:
        """After every tick; nothing here is in a hurry, so ten times a second is enough."""
        self._since += seconds
        if self._since < PERIOD - 1e-9:
            return
        seconds, self._since = self._since, 0.0
        if self._gps:
            self._gps.sense(stamp)
        if self._motors:
            self._motors.sense(seconds)
        if self._bluetooth:
            self._bluetooth.sense(stamp)
        if self._remote:
            self._remote.sense(stamp)
        if self._firmware:
            self._firmware.sense(stamp)
        if self._power:
            self._power.sense(stamp)

    def touch(self, kind: TouchKind) -> None:
        """A finger on the pad. Raises ComponentMissing."""
        if self._touch is None:
            raise ComponentMissing(Touch)
        self._touch.touch(kind)

    def plug(self, wire: bool) -> None:
        """A charger's plug. Raises ComponentMissing."""
        if self._battery is None:
            raise ComponentMissing(Battery)
        self._battery.plug(wire)

    def close(self) -> None:
        """The world ends."""
        for part in (self._firmware, self._power):
            if part:
                part.close()


def _simulated(robot: Robot, interface: type[Component], kind: type[P]) -> P | None:
    """The robot's component of this interface if it is the simulated one."""
    if interface not in robot:
        return None
    part = robot[interface]
    return part if isinstance(part, kind) else None
