"""Chapter "system": faults of the robot, in the vendor's numbers."""

from __future__ import annotations

from roboglot.model.components.motion.emergency_stop import is_stopped
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.system.health import Fault, FaultLevel, Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Refused
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.system.system import BaseError, BaseHealthInfo, HealthPart, Level, health_record

API = "/api/core/system/v1/robot/health"
STOP = "emergency stop"  # the fault
LIMP = "the robot is limp after an emergency stop: it has to stand up first"
LEVELS = {FaultLevel.WARNING: Level.WARN, FaultLevel.ERROR: Level.ERROR, FaultLevel.FATAL: Level.FATAL}
# Level, component, code and the number within the component, by the model's name of the fault, where known from robots.
NUMBERS = {
    STOP: (Level.ERROR, HealthPart.SYSTEM, 0x0100, 1),
    "brake released": (Level.ERROR, HealthPart.SYSTEM, 0x0700, 7),
    "not localized": (Level.ERROR, HealthPart.SYSTEM, 0x0900, 9),
    "battery low": (Level.WARN, HealthPart.POWER, 0x0100, 2),
    "motor alarm": (Level.ERROR, HealthPart.MOTION, 0x0100, 1),
    "bumper stuck": (Level.ERROR, HealthPart.SENSOR, 0x0100, 1),
}
# All others have numbers of our own: code 0x70xx, counted here.
OWN = (
    "fallen", "battery empty", "battery hot", "cliff", "jack alarm", "network lost", "disk full", "lidar lost",
    "motor hot", "network slow", "depth camera lost", "range sensor lost", "navigation unavailable",
)  # fmt: skip
OWN_PARTS = {
    "battery": HealthPart.POWER,
    "base": HealthPart.MOTION,
    "motors": HealthPart.MOTION,
    "jack": HealthPart.MOTION,
    "lidar": HealthPart.SENSOR,
    "cliff": HealthPart.SENSOR,
    "depth camera": HealthPart.SENSOR,
    "range sensors": HealthPart.SENSOR,
}
OWN_CODE, UNKNOWN_CODE = 0x7000, 0x70FF


def record_of(fault: Fault) -> BaseError:
    """Return a fault in the API's form."""
    if fault.name in NUMBERS:
        level, part, code, kind = NUMBERS[fault.name]
        return health_record(level, part, code, kind, fault.message)
    code = OWN_CODE + OWN.index(fault.name) if fault.name in OWN else UNKNOWN_CODE
    part = OWN_PARTS.get(fault.component, HealthPart.SYSTEM)
    return health_record(LEVELS[fault.level], part, code, code & 0xFF, fault.message)


@TABLE.on(f"GET {API}", right=Right.SEE)
def get_robot_health(context: Context) -> BaseHealthInfo:
    """Return the current faults."""
    robot = context.robot
    records = _records(robot)
    levels = {record.level for record in records}
    return BaseHealthInfo(
        has_warning=Level.WARN in levels,
        has_error=Level.ERROR in levels,
        has_fatal=Level.FATAL in levels,
        base_error=records,
        has_system_emergency_stop=is_stopped(robot),
        has_lidar_disconnected=Lidar not in robot or _has(robot, "lidar lost"),
        has_sdp_disconnected=Link in robot and robot[Link].state is not LinkState.UP,  # its driver's link is down
        has_depth_camera_disconnected=_has(robot, "depth camera lost"),
    )


def _records(robot: Robot) -> list[BaseError]:
    """Return faults not dismissed. Limp legs are an emergency stop that the model has no fault for."""
    records = [record_of(fault) for fault in (robot[Health].faults if Health in robot else ())]
    if is_stopped(robot) and not _has(robot, STOP):
        records.append(health_record(*NUMBERS[STOP], "emergency stop: the legs are limp"))
    return records


def _has(robot: Robot, name: str) -> bool:
    """Return whether a fault is present, dismissed or not."""
    return Health in robot and robot[Health].has(name)


@TABLE.on(f"DELETE {API}/{{error_code}}", right=Right.DRIVE, needs=(Health,))
def clear_robot_health(context: Context, error_code: int) -> None:
    """Dismiss a fault, which returns while its cause persists; 400 for an unknown code, 403 while the legs are limp.

    The flags still show the robot's state.
    """
    health = context.robot[Health]
    if error_code not in {record.error_code for record in _records(context.robot)}:
        raise HttpError(400, "Invalid Error Code", str(error_code))
    faults = [fault for fault in health.faults if record_of(fault).error_code == error_code]
    if not faults:
        raise Refused(LIMP)
    for fault in faults:
        health.dismiss(fault.id)
