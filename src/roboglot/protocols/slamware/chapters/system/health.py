"""Chapter "system": faults of the robot, in the vendor's numbers."""

from __future__ import annotations

from roboglot.model.components.motion.emergency_stop import is_stopped
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.system.health import Health
from roboglot.model.components.system.link import Link, LinkState
from roboglot.model.errors import Refused
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.system.fault_numbers import NUMBERS, STOP, record_of
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.errors import HttpError
from roboglot.protocols.slamware.table import TABLE
from roboglot.wire.slamware.chapters.system.system import BaseError, BaseHealthInfo, Level, health_record

API = "/api/core/system/v1/robot/health"
LIMP = "the robot is limp after an emergency stop: it has to stand up first"


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
