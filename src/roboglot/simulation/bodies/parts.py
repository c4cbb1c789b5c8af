"""Puts together what sits on a simulated robot's chassis: gimbal, blaster, armor, lights, arm, extension ports …"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboglot.model.components.component import Component
from roboglot.model.components.interaction.armor import Armor
from roboglot.model.components.interaction.blaster import Blaster
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.light_effects import ShownLight
from roboglot.model.components.interaction.skin import ElectronicSkin
from roboglot.model.components.motion.arm import Arm
from roboglot.model.components.motion.gimbal import Gimbal
from roboglot.model.components.motion.gripper import Gripper
from roboglot.model.components.motion.motion_status import MotionStatus
from roboglot.model.components.motion.servo import Servos
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.system.pwm import PwmPorts
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.things import Things
from roboglot.simulation.components.interaction.armor import SimulatedArmor
from roboglot.simulation.components.interaction.blaster import SimulatedBlaster
from roboglot.simulation.components.interaction.skin import SimulatedSkin
from roboglot.simulation.components.motion.arm import SimulatedArm
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.gimbal import SimulatedGimbal
from roboglot.simulation.components.motion.gripper import SimulatedGripper
from roboglot.simulation.components.motion.motion_status import SimulatedMotionStatus
from roboglot.simulation.components.motion.servo import SimulatedServos
from roboglot.simulation.components.sensing.adapter import SimulatedSensorAdapters
from roboglot.simulation.components.sensing.imu import SimulatedImu
from roboglot.simulation.components.sensing.range_sensor import SimulatedRangeSensors
from roboglot.simulation.components.system.pwm import SimulatedPwmPorts
from roboglot.simulation.world.beads import Beads
from roboglot.simulation.world.randomness import stream

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays


@dataclass(frozen=True, slots=True)
class Matter:
    """What of the world the parts of all robots share."""

    rays: Rays
    beads: Beads
    things: Things


class Parts:
    """One robot's; ``robot`` gets those that its body has."""

    def __init__(
        self,
        robot: Robot,
        hull: Hull,
        base: SimulatedBase,
        imu: SimulatedImu | None,
        matter: Matter,
        seed: int,
        tick: float,
    ) -> None:
        body, events, name = hull.body, robot.events, robot.id
        self._robot = robot
        self.gimbal = SimulatedGimbal(body.gimbal, hull, base, robot) if body.gimbal else None
        self.blaster: SimulatedBlaster | None = None
        if body.blaster and self.gimbal:
            chance = stream(seed, name, "blaster")
            self.blaster = SimulatedBlaster(body.blaster, hull, self.gimbal, matter.beads, events, chance)
        self.armor = SimulatedArmor(body.armor, hull, self.gimbal, events) if body.armor else None
        if self.armor:
            matter.beads.targets.append(self.armor)
        self.light = ShownLight(body.light.zones, robot.clock) if body.light else None
        self.skin = SimulatedSkin(robot, seed) if body.skin else None
        self.arm = SimulatedArm(body.arm, hull, robot) if body.arm else None
        self.gripper: SimulatedGripper | None = None
        if body.gripper and self.arm:
            self.gripper = SimulatedGripper(body.gripper, hull, self.arm, matter.things, robot)
        self.servos = SimulatedServos(body.servos, robot) if body.servos else None
        self.pwm = SimulatedPwmPorts(body.pwm_ports) if body.pwm_ports else None
        adapters = body.sensor_adapters
        self.adapters = SimulatedSensorAdapters(adapters, robot.clock, events) if adapters else None
        self.ranges: SimulatedRangeSensors | None = None
        if body.range_sensors:
            chance = stream(seed, name, "range sensors")
            self.ranges = SimulatedRangeSensors(body.range_sensors, hull, matter.rays, chance, tick)
        status = body.motion_status
        self.status = SimulatedMotionStatus(status, hull, base, imu) if status and imu else None
        self._join()

    def _join(self) -> None:
        parts: tuple[tuple[type[Component], Component | None], ...] = (
            (Gimbal, self.gimbal),
            (Blaster, self.blaster),
            (Armor, self.armor),
            (Light, self.light),
            (ElectronicSkin, self.skin),
            (Arm, self.arm),
            (Gripper, self.gripper),
            (Servos, self.servos),
            (PwmPorts, self.pwm),
            (SensorAdapters, self.adapters),
            (RangeSensors, self.ranges),
            (MotionStatus, self.status),
        )
        for interface, part in parts:
            if part is not None:
                self._robot.add(interface, part)

    def control(self, seconds: float) -> None:
        """Before the base's control and the physics of a tick."""
        if self.gimbal:
            self.gimbal.control(seconds)
        if self.blaster and not self.blaster.idle:
            self.blaster.control(seconds, self._robot.clock.time())
        if self.arm:
            self.arm.control(seconds)
        if self.gripper:
            self.gripper.control(seconds)
        if self.servos:
            self.servos.control(seconds)

    def sense(self, stamp: float, seconds: float) -> None:
        """After the physics, the IMU and the base."""
        if self.armor:
            self.armor.sense(stamp, seconds)
        if self.ranges:
            self.ranges.sense(stamp)
        if self.status:
            self.status.sense(stamp)

    def displaced(self) -> None:
        """The robot was lifted and put elsewhere."""
        if self.gimbal:
            self.gimbal.displaced()
