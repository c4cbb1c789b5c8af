"""Functions of every group: ``state`` and ``set_log`` (4.4.x), and ``cyberdog`` itself (4.4.01)."""

from __future__ import annotations

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.interaction.light import Light
from roboglot.model.components.interaction.speaker import Speaker
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.gps import Gps
from roboglot.model.components.sensing.hearing import Hearing
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.sensing.range_sensor import RangeSensors
from roboglot.model.components.sensing.time_of_flight import TimeOfFlight
from roboglot.model.components.sensing.touch import Touch
from roboglot.model.components.sensing.vision import Vision
from roboglot.model.components.system.network import Network
from roboglot.programs.functions.results import StateCode, state
from roboglot.programs.functions.session import Session, TaskEnded
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

STALE_AFTER = 3.0  # s without a new reading

# The component that each group needs.
PARTS: dict[str, type[Component]] = {
    "network": Network,
    "follow": Vision,
    "audio": Speaker,
    "led": Light,
    "bms": Battery,
    "touch": Touch,
    "gps": Gps,
    "tof": TimeOfFlight,
    "lidar": Lidar,
    "ultrasonic": RangeSensors,
    "odometer": Odometry,
    "imu": Imu,
    "personnel": Vision,
    "gesture": Vision,
    "skeleton": Vision,
    "train": Hearing,
    "navigation": Navigation,
}
GROUPS = ("motion", "task", *PARTS)


def state_of(session: Session, group: str) -> Record:
    """Return the state of a group: its sensor's if that fails, else the result of its last call."""
    component = PARTS.get(group)
    if component is None:
        return session.states.get(group, state())
    if component not in session.robot:
        return state(StateCode.FAIL, f"this robot has no {group}")
    part = session.robot[component]
    reading = part.scan if isinstance(part, Lidar) else part.reading if isinstance(part, Odometry | Imu | Gps) else None
    if isinstance(part, Lidar) and reading is None:
        return state(StateCode.NO_DATA_UPDATE, "the lidar has not finished a turn yet")
    if reading is not None and session.robot.clock.time() - reading.stamp > STALE_AFTER:
        return state(StateCode.NO_DATA_UPDATE, f"nothing new from the {group} for {STALE_AFTER:g} s")
    return session.states.get(group, state())


def _declare(group: str) -> None:
    @ABILITIES.on(f"cyberdog.{group}.state")
    async def read_state(session: Session) -> Record:
        """Return the state of the group (attribute)."""
        return state_of(session, group)

    @ABILITIES.on(f"cyberdog.{group}.set_log")
    async def set_log(session: Session, log: bool = False) -> Record:
        """Write the group's calls to the program's log, or stop doing so."""
        (session.logging.add if log else session.logging.discard)(group)
        return state()


for _group in GROUPS:
    _declare(_group)


@ABILITIES.on("cyberdog.state")
async def read_state(session: Session) -> Record:
    """First state of a group that is not success, or success (attribute; 4.4.01).

    What the robot is not made of does not count.
    """
    for group in GROUPS:
        if group in PARTS and PARTS[group] not in session.robot:
            continue
        found = state_of(session, group)
        if found.fields["code"] != StateCode.SUCCESS:
            return state(StateCode(found.fields["code"]), f"{group}: {found.fields['describe']}")
    return state()


@ABILITIES.on("cyberdog.set_log")
async def set_log(session: Session, log: bool = False) -> Record:
    """Switch the logs of all groups (4.4.01)."""
    (session.logging.update if log else session.logging.difference_update)(GROUPS)
    return state()


@ABILITIES.on("cyberdog.shutdown")
async def shutdown(_session: Session) -> None:
    """End the program here, and cancel what it started (4.4.01)."""
    raise TaskEnded
