"""Motions on the model: servo frames with their watchdog, motions with a result. Knows no message."""

from __future__ import annotations

from dataclasses import dataclass

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.base import Base
from roboglot.model.components.battery import Battery
from roboglot.model.components.driving import BASE, Driving
from roboglot.model.components.legs import Legs, Posture
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.errors import told
from roboglot.wire.cyberdog.codes import MachineState
from roboglot.wire.cyberdog.motions import (
    ALLOWED_ON_LOW_BATTERY,
    ALLOWED_WHEN_STOPPED,
    GAITS,
    Motion,
    MotionCode,
    SwitchStatus,
)

SOURCE = "cyberdog"
WATCHDOG = 0.2  # s without a servo frame, then the robot stands still
DURATION_MAX = 60.0  # s that one walk by a result command may take: nobody can stop it but by an emergency stop
PROTECTED_BELOW, LOW_POWER_BELOW = 0.20, 0.05  # charge
MOVING = 0.01  # m/s or rad/s from which the body counts as walking
FIXED_TIME = frozenset(
    {Motion.EMERGENCY_STOP, Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE, Motion.STAND_UP, Motion.WALK_STAND}
)


@dataclass(frozen=True, slots=True)
class Executed:
    """What became of a servo frame."""

    code: MotionCode
    status: SwitchStatus = SwitchStatus.NORMAL


class Gaits:
    """One motion at a time, by a servo's frames or by a command with a result."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: int = Motion.STAND_UP  # the motion commanded last
        self._servo: Action | None = None
        self._rising: Action | None = None  # getting up for a servo
        self._performing: Action | None = None

    @property
    def state(self) -> MachineState:
        """What the charge allows."""
        charge = self._robot[Battery].state.percentage if Battery in self._robot else 1.0
        if charge <= LOW_POWER_BELOW:
            return MachineState.LOW_POWER
        return MachineState.PROTECTED if charge <= PROTECTED_BELOW else MachineState.ACTIVE

    @property
    def posture(self) -> Posture:
        """A body without legs always stands."""
        return self._robot[Legs].posture if Legs in self._robot else Posture.STANDING

    @property
    def motion(self) -> int:
        """The number of what the body does now, whoever commanded it."""
        match self.posture:
            case Posture.LYING:
                return Motion.LIE_DOWN
            case Posture.LIMP:
                return Motion.EMERGENCY_STOP
            case Posture.CHANGING:
                sinking = self._last in (Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE)
                return Motion.LIE_DOWN if sinking else Motion.STAND_UP
        velocity = self._robot[Base].velocity if Base in self._robot else Twist()
        if velocity.speed > MOVING or abs(velocity.yaw) > MOVING:
            ours = _under_way(self._servo) or _under_way(self._performing)
            return self._last if ours and self._last in GAITS else Motion.TROT_SLOW
        return Motion.WALK_STAND if self._last in GAITS else Motion.STAND_UP

    def servo(self, motion: int, velocity: Twist) -> Executed:
        """One frame of a walk: keep ``velocity`` (base_link) until the next, or for WATCHDOG seconds.

        A robot that does not stand gets up first; frames that come meanwhile are taken, but not walked.
        """
        if refusal := self._refusal(motion):
            status = SwitchStatus.EMERGENCY_STOPPED if refusal is MotionCode.EMERGENCY_STOPPED else SwitchStatus.NORMAL
            return Executed(refusal, SwitchStatus.LOW_BATTERY if refusal is MotionCode.LOW_BATTERY else status)
        if motion not in GAITS:
            return Executed(MotionCode.UNSUPPORTED)
        if _under_way(self._performing):
            return Executed(MotionCode.BUSY)
        if _under_way(self._rising):
            return Executed(MotionCode.DONE, SwitchStatus.CHANGING)
        try:
            if self.posture is not Posture.STANDING:
                self._last, self._rising = Motion.STAND_UP, self._robot[Legs].stand(source=SOURCE)
                return Executed(MotionCode.DONE, SwitchStatus.CHANGING)
            self._servo = self._robot[Driving].drive(velocity, lifetime=WATCHDOG, source=f"{SOURCE} servo")
        except RobotError as error:
            return Executed(told(error).motion)
        self._last = motion
        return Executed(MotionCode.DONE)

    def end_servo(self) -> Executed:
        """The last frame: brake and stand."""
        if self._servo:
            self._servo.cancel()
        return Executed(MotionCode.DONE)

    def perform(self, motion: int, velocity: Twist, duration: float) -> Action | MotionCode:
        """Begin a motion that ends by itself, or say why not. ``duration`` (s) is for walks alone."""
        if refusal := self.check(motion, duration):
            return refusal
        try:
            return self._begin(motion, velocity, duration)
        except RobotError as error:
            return told(error).motion

    async def ended(self, action: Action) -> MotionCode:
        """Wait for the end of a motion, and how that is told."""
        if await action.done() is ActionStatus.SUCCEEDED:
            return MotionCode.DONE
        if self.posture is Posture.LIMP:
            return MotionCode.EMERGENCY_STOPPED
        return told(action.error).motion if action.error else MotionCode.EXECUTION

    def check(self, motion: int, duration: float) -> MotionCode | None:
        """Why ``perform`` would refuse; None if it would not."""
        if refusal := self._refusal(motion):
            return refusal
        if motion not in GAITS and motion not in FIXED_TIME:
            return MotionCode.UNSUPPORTED
        if (duration > 0) == (motion in FIXED_TIME) or not 0 <= duration <= DURATION_MAX:
            return MotionCode.PARAMETERS
        serving = _under_way(self._rising) or (_under_way(self._servo) and motion != Motion.WALK_STAND)
        busy = _under_way(self._performing) or serving
        return MotionCode.BUSY if busy and motion != Motion.EMERGENCY_STOP else None

    def _begin(self, motion: int, velocity: Twist, duration: float) -> Action | MotionCode:
        robot = self._robot
        match motion:
            case Motion.EMERGENCY_STOP:
                self._stop()
                return MotionCode.DONE
            case Motion.STAND_UP if Legs not in robot:
                return MotionCode.DONE
            case Motion.STAND_UP:
                action = robot[Legs].stand(source=SOURCE)
            case Motion.LIE_DOWN | Motion.LIE_DOWN_PASSIVE:
                action = robot[Legs].lie_down(source=SOURCE)
            case Motion.WALK_STAND:
                action = robot[Driving].drive(Twist(), lifetime=WATCHDOG, source=SOURCE)
            case _:
                action = robot[Driving].drive(velocity, lifetime=duration, source=SOURCE)
        self._last, self._performing = motion, action
        return action

    def _stop(self) -> None:
        """Without legs to give way, standing still at once is the nearest to it."""
        if Legs in self._robot:
            self._robot[Legs].go_limp()
        else:
            for action in self._robot.actions.running(BASE):
                action.cancel("emergency stop")

    def _refusal(self, motion: int) -> MotionCode | None:
        if self.posture is Posture.LIMP and motion not in ALLOWED_WHEN_STOPPED:
            return MotionCode.EMERGENCY_STOPPED
        if self.state is MachineState.ACTIVE or motion in ALLOWED_ON_LOW_BATTERY:
            return None
        return MotionCode.LOW_BATTERY if self.state is MachineState.PROTECTED else MotionCode.STATE


def _under_way(action: Action | None) -> bool:
    return action is not None and not action.status.ended
