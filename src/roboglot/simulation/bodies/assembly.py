"""Puts a simulated robot's components together, as its body's description has them, and runs them in order."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs
from roboglot.model.components.sensing.bumper import Bumper
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.network import Network
from roboglot.model.geometry import Pose
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.parts import Matter, Parts
from roboglot.simulation.components.energy.battery import SimulatedBattery
from roboglot.simulation.components.energy.dock_contact import SimulatedDockContact
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.bumper_stop import BumperStop
from roboglot.simulation.components.motion.legs import SimulatedLegs
from roboglot.simulation.components.motion.soft_touch import SoftTouch
from roboglot.simulation.components.sensing.bumper import SimulatedBumper
from roboglot.simulation.components.sensing.imu import SimulatedImu, earth_field
from roboglot.simulation.components.sensing.lidar import SimulatedLidar
from roboglot.simulation.components.sensing.odometry import SimulatedOdometry
from roboglot.simulation.components.system.network import SimulatedNetwork
from roboglot.simulation.radio.radio import Radio
from roboglot.simulation.world.randomness import stream
from roboglot.simulation.world.sight import Sight

SLOW = 5  # ticks between looks at what changes slowly


class SimulatedRobot:
    """The simulated components of one robot; ``robot`` gets them and their events. ``north``: where it lies, rad."""

    def __init__(
        self,
        robot: Robot,
        hull: Hull,
        docks: list[list[Pose]],
        radio: Radio,
        sight: Sight,
        matter: Matter,
        seed: int,
        tick: float,
        north: float,
    ) -> None:
        body, events, name = hull.body, robot.events, robot.id
        self._base = SimulatedBase(body.base, hull)
        self._legs = SimulatedLegs(body.legs, hull, self._base, robot, tick) if body.legs else None
        self._imu: SimulatedImu | None = None
        if body.imu:
            chances = stream(seed, name, "imu"), stream(seed, name, "compass")
            self._imu = SimulatedImu(body.imu, hull, *chances, earth_field(north))
        self._odometry: SimulatedOdometry | None = None
        if body.odometry and self._imu:
            self._odometry = SimulatedOdometry(body.odometry, self._base, self._imu, stream(seed, name, "odometry"))
        self._lidar: SimulatedLidar | None = None
        if body.lidar:
            chance = stream(seed, name, "lidar")
            self._lidar = SimulatedLidar(body.lidar, hull, sight, self._odometry, events, chance, tick)
        contact = body.dock_contact
        self._dock = SimulatedDockContact(contact, hull, docks, events) if contact else None
        battery = body.battery
        self._battery = SimulatedBattery(battery, hull, self._base, self._dock, events) if battery else None
        self._bumper = SimulatedBumper(hull, events) if body.bumper else None
        self._bumper_stop: BumperStop | None = None
        self._soft_touch: SoftTouch | None = None
        if body.bumper and self._bumper:
            self._bumper_stop = BumperStop(robot, self._base, self._bumper)
            self._soft_touch = SoftTouch(body.bumper.touch_speed, hull, self._base, self._bumper, matter.rays)
        radio_chance = stream(seed, name, "network")
        self._network = SimulatedNetwork(body.network, hull, radio, robot, radio_chance) if body.network else None
        self._slow, self._until_slow = 0.0, 1
        self._join(robot)
        self.parts = Parts(robot, hull, self._base, self._imu, matter, seed, tick)

    def _join(self, robot: Robot) -> None:
        """Give the robot what there is."""
        parts: tuple[tuple[type[Component], Component | None], ...] = (
            (Base, self._base),
            (Legs, self._legs),
            (Imu, self._imu),
            (Odometry, self._odometry),
            (Lidar, self._lidar),
            (DockContact, self._dock),
            (Battery, self._battery),
            (Bumper, self._bumper),
            (Network, self._network),
        )
        for interface, part in parts:
            if part is not None:
                robot.add(interface, part)

    def control(self, seconds: float) -> None:
        """Before the physics of a tick."""
        self.parts.control(seconds)
        if self._legs:
            self._legs.control(seconds)  # first: what the legs do, the base passes on
        self._base.control(seconds)

    def sense(self, stamp: float, seconds: float) -> None:
        """After it: what later sensors build on comes first."""
        if self._imu:
            self._imu.sense(stamp, seconds)
        if self._odometry:
            self._odometry.sense(stamp, seconds)
        if self._dock:
            self._dock.sense(stamp)
        if self._bumper and self._bumper_stop and self._bumper.sense(stamp):
            self._bumper_stop.sense()
        if self._soft_touch:
            self._soft_touch.sense()
        self._slow += seconds
        self._until_slow -= 1
        if not self._until_slow:
            if self._battery:
                self._battery.sense(stamp, self._slow)
            if self._network:
                self._network.sense(stamp)
            self._slow, self._until_slow = 0.0, SLOW
        if self._lidar:
            self._lidar.sense(stamp)
        self.parts.sense(stamp, seconds)

    def displaced(self) -> None:
        """The robot was lifted and put elsewhere."""
        if self._imu:
            self._imu.forget()
        self.parts.displaced()
