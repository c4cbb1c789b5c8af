"""Gives a robot what makes it a delivery robot, and its health; runs those parts after every tick."""

from __future__ import annotations

from typing import TYPE_CHECKING

from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.logistics.lift_client import LiftClient
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.emergency_braking import EmergencyBraking
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.cliff import Cliff
from roboglot.model.components.sensing.depth_camera import DepthCamera
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.sensor_masks import SensorMasks
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.health import Health
from roboglot.model.errors import Refused
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.building.building import Building
from roboglot.simulation.components.logistics.cargo import SimulatedCargo
from roboglot.simulation.components.logistics.jack import SimulatedJack
from roboglot.simulation.components.logistics.lift_client import SimulatedLiftClient
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.emergency_braking import SimulatedEmergencyBraking
from roboglot.simulation.components.motion.emergency_stop import SimulatedEmergencyStop
from roboglot.simulation.components.sensing.bumper import SimulatedBumper
from roboglot.simulation.components.sensing.cliff import SimulatedCliff
from roboglot.simulation.components.sensing.depth_camera import SimulatedDepthCamera
from roboglot.simulation.components.sensing.sensor_masks import SimulatedSensorMasks
from roboglot.simulation.components.system.disk import SimulatedDisk
from roboglot.simulation.components.system.health_monitor import HealthWatch
from roboglot.simulation.world.randomness import stream

if TYPE_CHECKING:
    from roboglot.simulation.world.rays import Rays

FALLEN_BELOW = -0.1  # m under its floor
FALLEN = "fallen"


class Equipment:
    """Those parts that the robot's body has."""

    def __init__(self, robot: Robot, hull: Hull, building: Building, rays: Rays, seed: int) -> None:
        body, events = hull.body, robot.events
        base = robot[Base]
        assert isinstance(base, SimulatedBase)
        self._hull, self._base, self._footing = hull, base, building.footing
        self._cliff = SimulatedCliff(body.cliff, hull, base, building.footing, events) if body.cliff else None
        self._braking: SimulatedEmergencyBraking | None = None
        if body.emergency_braking and Lidar in robot:
            radius = body.hull.radius
            self._braking = SimulatedEmergencyBraking(body.emergency_braking, radius, base, robot[Lidar], events)
        self._jack = SimulatedJack(body.jack, hull, building.shelves, robot) if body.jack else None
        depth: SimulatedDepthCamera | None = None
        if body.depth_camera:
            chance = stream(seed, robot.id, "depth camera")
            depth = SimulatedDepthCamera(body.depth_camera, hull, rays, robot.clock, chance)
            robot.add(DepthCamera, depth)
        if self._cliff:
            robot.add(Cliff, self._cliff)
        if self._braking:
            robot.add(EmergencyBraking, self._braking)
        if self._jack:
            robot.add(Jack, self._jack)
        if body.emergency_stop:
            robot.add(EmergencyStop, SimulatedEmergencyStop(base, robot))
        if body.cargo:
            robot.add(Cargo, SimulatedCargo(body.cargo, robot))
        if body.lift_client and building.lift:
            robot.add(LiftClient, SimulatedLiftClient(body.lift_client, building.lift, robot))
        bumper: SimulatedBumper | None = None
        if Bumper in robot:
            bumper = robot[Bumper]  # type: ignore[assignment]
        if bumper or self._cliff or depth:
            robot.add(SensorMasks, SimulatedSensorMasks(bumper, self._cliff, depth))
        robot.add(Disk, SimulatedDisk(robot))
        self._watch = HealthWatch(robot, robot.add(Health, Health(robot.clock, events)), hull)

    def sense(self, stamp: float) -> None:
        """After every tick."""
        hull = self._hull
        if hull.rise < FALLEN_BELOW and hull.hand is None and not self._footing.carries(hull.elevation):
            self._base.lock(FALLEN, Refused("the robot fell down"))
            self._base.cut()
        if self._cliff:
            self._cliff.sense(stamp)
        if self._braking:
            self._braking.sense(stamp)
        if self._jack:
            self._jack.sense()
        self._watch.sense(stamp)

    def displaced(self) -> None:
        """Somebody put the robot elsewhere, on its wheels."""
        self._base.unlock(FALLEN)
        if self._jack:
            self._jack.displaced()
