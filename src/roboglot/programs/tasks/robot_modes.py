"""Operations that the robot allows in each of its modes: the manual's table (0.2.2.3), and the current mode.

Knows the battery, the power mode and the firmware. Three modes are in the table only: no client can reach a booting
robot (Uninitialized), self-tests run during normal work (SelfCheck), and a robot with a fault stays in use (Error).
"""

from __future__ import annotations

from enum import StrEnum

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.motion.emergency_stop import is_stopped
from roboglot.model.components.system.disk import Disk
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.components.system.lease import Lease
from roboglot.model.robot import Robot
from roboglot.programs.errors import LimitReached, NotAllowed
from roboglot.programs.tasks.states import TaskOperation

PROTECTED_BELOW = 0.20  # charge
LOW_POWER_BELOW = 0.05


class RobotMode(StrEnum):
    """Mode of the robot as a whole. The manual spells the self-test "SekfCheck"."""

    UNINITIALIZED = "Uninitialized"
    SET_UP = "SetUp"
    TEAR_DOWN = "TearDown"
    SELF_CHECK = "SelfCheck"
    ACTIVE = "Active"
    DEACTIVE = "DeActive"
    PROTECTED = "Protected"
    LOW_POWER = "LowPower"
    OTA = "OTA"
    ERROR = "Error"


_EVERYTHING = frozenset(TaskOperation)
_LOOK_AND_END = frozenset(
    {TaskOperation.INQUIRY, TaskOperation.SUSPEND, TaskOperation.SHUTDOWN, TaskOperation.STOP},
)
_ASLEEP = _LOOK_AND_END | {TaskOperation.SAVE, TaskOperation.DELETE}
_BEGINNINGS = frozenset({TaskOperation.DEBUG, TaskOperation.RUN, TaskOperation.RECOVER, TaskOperation.START})

ALLOWED: dict[RobotMode, frozenset[TaskOperation]] = {
    RobotMode.UNINITIALIZED: frozenset(),
    RobotMode.SET_UP: frozenset(),
    RobotMode.TEAR_DOWN: frozenset(),
    RobotMode.SELF_CHECK: _LOOK_AND_END,
    RobotMode.ACTIVE: _EVERYTHING,
    RobotMode.DEACTIVE: _ASLEEP,
    RobotMode.PROTECTED: _EVERYTHING,
    RobotMode.LOW_POWER: _ASLEEP,
    RobotMode.OTA: _LOOK_AND_END,
    RobotMode.ERROR: _LOOK_AND_END,
}


def mode_of(robot: Robot) -> RobotMode:
    """Return the robot's current mode; missing components do not affect it."""
    power = robot[Power].mode if Power in robot else PowerMode.AWAKE
    firmware = robot[Firmware].progress.state if Firmware in robot else FirmwareState.IDLE
    if power is PowerMode.OFF or firmware is FirmwareState.REBOOTING:
        return RobotMode.TEAR_DOWN
    if firmware is FirmwareState.INSTALLING:
        return RobotMode.OTA
    if Firmware in robot and robot[Firmware].restarting is not None:
        return RobotMode.SET_UP
    if power is PowerMode.ASLEEP:
        return RobotMode.DEACTIVE
    charge = robot[Battery].state.percentage if Battery in robot else 1.0
    if charge < LOW_POWER_BELOW or power in (PowerMode.LOW_POWER, PowerMode.WAKING_UP):
        return RobotMode.LOW_POWER
    return RobotMode.PROTECTED if charge < PROTECTED_BELOW else RobotMode.ACTIVE


def check_mode(robot: Robot, operation: TaskOperation) -> None:
    """Raise ProgramError if the robot's mode (0.2.2.3), a teacher's lock or a full disk forbids ``operation``."""
    mode = mode_of(robot)
    if operation not in ALLOWED[mode]:
        raise NotAllowed(
            f"The current robot is in [{mode}] mode and does not support <{operation}> operation.",
        )
    if operation in _BEGINNINGS and Lease in robot and (locked := robot[Lease].locked):
        raise NotAllowed(locked)  # it would move once it is unlocked
    if operation is TaskOperation.SAVE and Disk in robot and robot[Disk].free <= 0:
        raise LimitReached("the disk is full")


def check_scheduled(robot: Robot) -> None:
    """Raise NotAllowed if no task may begin by its schedule: as for START, and after a person stopped the robot."""
    check_mode(robot, TaskOperation.START)
    if is_stopped(robot):
        raise NotAllowed("the emergency stop holds the robot")
    if Lease in robot and (stopped := robot[Lease].stopped):
        raise NotAllowed(f"since it was {stopped}, the robot waits for a command")


def end_wait(robot: Robot) -> None:
    """Let scheduled tasks begin again: a client has started a program after a person stopped the robot."""
    if Lease in robot:
        robot[Lease].stopped = ""
