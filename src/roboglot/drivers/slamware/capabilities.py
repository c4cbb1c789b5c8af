"""Components of a Slamware robot and where they are only approximate. Source of the capability page."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.energy.power import Power
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.logistics.cargo import Cargo
from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link
from roboglot.model.components.system.network import Network

# Component to a plain description of what is approximate about it; empty if exact.
APPROXIMATIONS: dict[type[Component], str] = {
    Base: "ahead, back and turning in pulses of MoveBy, arcs in turns; single wheels are refused, sideways is left out",
    Driving: "as the base; a side step is a turn, a way and a turn back",
    Odometry: "",
    Lidar: "five scans a second, sorted into even steps",
    Imu: "only where the robot has one",
    Battery: "no voltage and no cycles; current and temperature where the robot reports them",
    DockContact: "",
    Localization: "the pose is up to 0.1 s old",
    Mapping: "the map is up to 2 s old; merges keep the origin",
    Navigation: "by the robot's own skill, which goes on when the link is lost; plans begin where the robot is",
    Docking: "by the robot's own skill",
    Jack: "only where the robot has one; its stroke is assumed and its load is not reported",
    Cargo: "only where the robot has boxes; a door that moves cannot be stopped",
    Light: "only where the robot has strips; dark when it is connected; shows five effects, no lamp by itself",
    EmergencyStop: "shows what the robot has confirmed, within 0.5 s",
    Network: "internet access, gateway, other networks and the modem's signal are not reported",
    Power: "asleep or awake: no low power; switched off after whole minutes",
    Health: "unknown faults are named by their number; dismissing one does not clear it on the robot",
    Link: "",
}
