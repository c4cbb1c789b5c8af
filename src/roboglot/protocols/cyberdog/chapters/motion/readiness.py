"""Readiness for motions: charge, power, updates, motors, an emergency stop. Knows no motion under way."""

from __future__ import annotations

from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.energy.power import Power, PowerMode
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.components.motion.motors import Motors
from roboglot.model.components.system.firmware import Firmware, FirmwareState
from roboglot.model.components.system.health import MOTOR_ALARM, Health
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.protocols.cyberdog.chapters.motion.motion_states import entered
from roboglot.protocols.cyberdog.chapters.motion.motion_table import FIGURES, USERS, WALKS
from roboglot.wire.cyberdog.chapters.motion.motion import ALLOWED_ON_LOW_BATTERY, ALLOWED_WHEN_STOPPED, MotionCode
from roboglot.wire.cyberdog.codes import MachineState

PROTECTED_BELOW, LOW_POWER_BELOW = 0.20, 0.05  # charge
GOING = WALKS.keys() | USERS
UPDATING = frozenset({FirmwareState.INSTALLING, FirmwareState.INSTALLED, FirmwareState.REBOOTING})


def machine_state(robot: Robot) -> MachineState:
    """Return the state of the robot by charge, power mode and updates."""
    mode = robot[Power].mode if Power in robot else PowerMode.AWAKE
    if mode is PowerMode.OFF:
        return MachineState.SHUT_DOWN
    if Firmware in robot and robot[Firmware].progress.state in UPDATING:
        return MachineState.UPDATING
    if mode is not PowerMode.AWAKE:
        return MachineState.LOW_POWER
    charge = robot[Battery].state.percentage if Battery in robot else 1.0
    if charge <= LOW_POWER_BELOW:
        return MachineState.LOW_POWER
    return MachineState.PROTECTED if charge <= PROTECTED_BELOW else MachineState.ACTIVE


def posture_of(robot: Robot) -> Posture:
    """Return the posture; a body without legs always stands."""
    return robot[Legs].posture if Legs in robot else Posture.STANDING


def refusal_of(robot: Robot, motion: int) -> MotionCode | None:
    """Return the reason why the robot's state forbids ``motion``, or None."""
    if posture_of(robot) is Posture.LIMP and motion not in ALLOWED_WHEN_STOPPED:
        return MotionCode.EMERGENCY_STOPPED
    if motion in ALLOWED_ON_LOW_BATTERY:
        return None
    state = machine_state(robot)
    if state is MachineState.ACTIVE:
        if Health in robot and robot[Health].has(MOTOR_ALARM):
            return MotionCode.MOTOR_OFFLINE
        if motion in GOING and entered(robot):
            return MotionCode.STATE  # it is held up or lies on its back: its feet do not touch the floor
        return _unfit(robot) if motion in FIGURES else None
    return MotionCode.LOW_BATTERY if state is MachineState.PROTECTED else MotionCode.STATE


def _unfit(robot: Robot) -> MotionCode | None:
    """Return the reason why the body must not jump or dance, or None."""
    if Battery in robot and robot[Battery].state.supply is Supply.WIRE:
        return MotionCode.CHARGING
    if Motors in robot and robot[Motors].hottest > robot[Motors].hot:
        return MotionCode.MOTOR_HOT
    return None
