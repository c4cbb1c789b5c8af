"""Chapter "system": capabilities, name plate, battery, laser scan. Health, parameters and power have their files."""

from __future__ import annotations

import re
import uuid
import zlib

from roboglot.model.components.energy.battery import Battery, DockContact
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.logistics.delivery import Delivery
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.navigation import Navigation
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.components.system.firmware import Firmware
from roboglot.model.components.system.link import require_heard
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import pose3d
from roboglot.wire.slamware.chapters.system.system import (
    BatteryPack,
    Capability,
    DeviceInfo,
    DockingStatus,
    LaserScan,
    PowerStatus,
)

SLAMTEC = 255  # the only manufacturer number ever published
API = "/api/core/system/v1"
SLEEP_MODES = {
    PowerMode.AWAKE: "awake",
    PowerMode.WAKING_UP: "waking_up",
    PowerMode.LOW_POWER: "asleep",  # it responds, but its motors are off
    PowerMode.ASLEEP: "asleep",
    PowerMode.OFF: "asleep",
}


@TABLE.on(f"GET {API}/capabilities", right=Right.SEE)
def get_capabilities(context: Context) -> list[Capability]:
    """Return this robot's capabilities; ``core`` is enabled once it can navigate and its lidar turns.

    ``multi_floor`` is enabled while no map is being loaded.
    """
    robot = context.robot
    version = software_version(robot)
    core = Navigation in robot and Localization in robot and context.laser.running
    return [
        Capability("slamware.agent.core", version, core),
        Capability("slamware.agent.platform", version, True),
        Capability("slamware.agent.multi_floor", version, core and context.maps.ready),
        Capability("slamware.agent.delivery", version, core and Delivery in robot),
    ]


@TABLE.on(f"GET {API}/power/status", right=Right.SEE, needs=(Battery,))
def get_power_status(context: Context) -> PowerStatus:
    """Return the state of battery, dock and power mode."""
    require_heard(context.robot)
    state = context.robot[Battery].state
    docked = DockContact in context.robot and context.robot[DockContact].docked
    mode = context.robot[Power].mode if Power in context.robot else PowerMode.AWAKE
    restarting = Firmware in context.robot and context.robot[Firmware].restarting is not None
    return PowerStatus(
        battery_percentage=round(state.percentage * 100),
        docking_status=DockingStatus.ON_DOCK if docked else DockingStatus.NOT_ON_DOCK,
        is_charging=state.charging,
        is_dc_connected=state.supply is Supply.WIRE,
        power_stage="shutingdown" if mode is PowerMode.OFF else "restarting" if restarting else "running",
        sleep_mode=SLEEP_MODES[mode],
    )


@TABLE.on(f"GET {API}/battery/pack", right=Right.SEE, needs=(Battery,))
def get_battery_pack(context: Context) -> BatteryPack:
    """Return current (mA, positive: charging) and temperature (0.1 degrees Celsius)."""
    require_heard(context.robot)
    state = context.robot[Battery].state
    return BatteryPack(round(state.current * 1000, 1), 1, [round(state.temperature * 10)])


@TABLE.on(f"GET {API}/robot/info", right=Right.SEE)
def get_robot_info(context: Context) -> DeviceInfo:
    """Return the name plate; numbers that only the vendor assigns are derived from names, and stable."""
    plate = context.robot.description
    return DeviceInfo(
        manufacturer_id=SLAMTEC if plate.maker == "Slamtec" else 0,
        manufacturer_name=plate.maker,
        model_id=zlib.crc32(plate.model.encode()) & 0xFFFF,
        model_name=plate.model,
        device_id=device_id(context.robot),
        hardware_version=plate.hardware_version,
        software_version=software_version(context.robot),
    )


def software_version(robot: Robot) -> str:
    """Return the running version, which updates change."""
    return robot[Firmware].version if Firmware in robot else robot.description.software_version


def device_id(robot: Robot) -> str:
    """Return 32 upper-case hex digits: the serial number if it has that form, otherwise derived from it.

    Robots without one (an EP reports none) have their name instead. Raises Unconnected before the first report.
    """
    require_heard(robot)
    serial = robot.description.serial or robot.id
    bare = serial.replace("-", "")
    return (bare if re.fullmatch("[0-9a-fA-F]{32}", bare) else uuid.uuid5(uuid.NAMESPACE_OID, serial).hex).upper()


@TABLE.on(f"GET {API}/laserscan", right=Right.SEE, needs=(Lidar, Localization, Odometry))
def get_laser_scan(context: Context) -> LaserScan:
    """Return the lidar's last turn (rad from straight ahead, m) and the robot's pose at its time."""
    context.robot.require(Lidar)
    return LaserScan(pose3d(context.laser.pose), context.laser.points)
