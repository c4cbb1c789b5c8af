"""Motions on the model: servo frames with their watchdog, motions with a result. Knows no message."""

from __future__ import annotations

import asyncio
from collections.abc import Set
from dataclasses import dataclass

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.base import Base
from roboglot.model.components.battery import Battery
from roboglot.model.components.driving import BASE, Driving
from roboglot.model.components.firmware import Firmware, FirmwareState
from roboglot.model.components.health import MOTOR_ALARM, Health
from roboglot.model.components.legs import BodyPose, FootLift, Legs, Posture
from roboglot.model.components.motions import MOTIONS
from roboglot.model.components.motors import Motors
from roboglot.model.components.power import Power, PowerMode
from roboglot.model.errors import RobotError
from roboglot.model.geometry import STILL, Twist
from roboglot.model.robot import Robot
from roboglot.model.sensing import Supply
from roboglot.protocols.cyberdog.errors import told
from roboglot.protocols.cyberdog.motion_table import DANCES, FIGURES, FIXED_TIME, KNOWN, MAY_LAST, NUMBERS, POSES, WALKS
from roboglot.wire.cyberdog.codes import MachineState
from roboglot.wire.cyberdog.motions import (
    ALLOWED_ON_LOW_BATTERY,
    ALLOWED_WHEN_STOPPED,
    Motion,
    MotionCode,
    SwitchStatus,
)

SOURCE = "cyberdog"
WATCHDOG = 0.2  # s without a servo frame, then the robot stands still
DURATION_MAX = 60.0  # s that one walk by a result command may take: nobody can stop it but by an emergency stop
PASSIVE_TROT = 1.0  # s of that walk by a result command
POSE_TIME = 0.5  # s into a body pose for which no duration is given
PROTECTED_BELOW, LOW_POWER_BELOW = 0.20, 0.05  # charge
MOVING = 0.01  # m/s or rad/s from which the body counts as walking
UPDATING = frozenset({FirmwareState.INSTALLING, FirmwareState.INSTALLED, FirmwareState.REBOOTING})
UPRIGHT = BodyPose()


@dataclass(frozen=True, slots=True)
class Wish:
    """What a motion is asked for: velocity (base_link), how to hold the body, seconds, how to lift the feet."""

    velocity: Twist = STILL
    body: BodyPose = UPRIGHT
    seconds: float = 0.0
    lift: FootLift | None = None


NOTHING_SPECIAL = Wish()


@dataclass(frozen=True, slots=True)
class Executed:
    """What became of a servo frame; ``share`` (0..1) of the way to the commanded motion."""

    code: MotionCode
    status: SwitchStatus = SwitchStatus.NORMAL
    share: float = 1.0


class Gaits:
    """One motion at a time, by a servo's frames or by a command with a result."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: int = Motion.STAND_UP  # the motion commanded last
        self._servo: Action | None = None
        self._rising: Action | None = None  # getting up for a servo
        self._performing: Action | None = None
        self._body = UPRIGHT  # as the last servo frame wanted it
        self._standing = 0.0  # m, the belly's height when it stood last
        self._low = 0.0  # m, and when it began to get up
        self._sequences: set[asyncio.Task[MotionCode]] = set()

    @property
    def state(self) -> MachineState:
        """What charge, power mode and updates allow."""
        mode = self._robot[Power].mode if Power in self._robot else PowerMode.AWAKE
        if mode is PowerMode.OFF:
            return MachineState.SHUT_DOWN
        if Firmware in self._robot and self._robot[Firmware].progress.state in UPDATING:
            return MachineState.UPDATING
        if mode is not PowerMode.AWAKE:
            return MachineState.LOW_POWER
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
        if Legs in self._robot and (figure := self._robot[Legs].performing):
            return NUMBERS.get(figure, int(Motion.STAND_UP))
        match self.posture:
            case Posture.LYING:
                return Motion.LIE_DOWN
            case Posture.LIMP:
                return Motion.EMERGENCY_STOP
            case Posture.SITTING:
                return Motion.SIT_DOWN
            case Posture.CHANGING:
                sinking = self._last in (Motion.LIE_DOWN, Motion.LIE_DOWN_PASSIVE)
                return Motion.LIE_DOWN if sinking else Motion.STAND_UP
        velocity = self._robot[Base].velocity if Base in self._robot else Twist()
        if velocity.speed > MOVING or abs(velocity.yaw) > MOVING:
            ours = _under_way(self._servo) or _under_way(self._performing)
            return self._last if ours and self._last in WALKS else Motion.TROT_SLOW
        return Motion.WALK_STAND if self._last in WALKS else Motion.STAND_UP

    def servo(self, motion: int, wish: Wish) -> Executed:
        """One frame of a walk: keep the velocity until the next, or for WATCHDOG seconds.

        A robot that does not stand gets up first; frames that come meanwhile are taken, but not walked.
        """
        if refusal := self._refusal(motion):
            status = SwitchStatus.EMERGENCY_STOPPED if refusal is MotionCode.EMERGENCY_STOPPED else SwitchStatus.NORMAL
            return Executed(refusal, SwitchStatus.LOW_BATTERY if refusal is MotionCode.LOW_BATTERY else status)
        if motion not in WALKS:
            return Executed(MotionCode.UNSUPPORTED)
        if self._busy:
            return Executed(MotionCode.BUSY)
        if _under_way(self._rising):
            return Executed(MotionCode.DONE, SwitchStatus.CHANGING, self._risen)
        try:
            if self.posture is not Posture.STANDING:
                self._low = self._robot[Legs].body_height
                self._last, self._rising = Motion.STAND_UP, self._robot[Legs].stand(source=SOURCE)
                return Executed(MotionCode.DONE, SwitchStatus.CHANGING, 0.0)
            self._hold(wish.body)
            self._servo = self._walk(motion, wish, WATCHDOG, f"{SOURCE} servo")
        except RobotError as error:
            return Executed(told(error).motion)
        self._last = motion
        return Executed(MotionCode.DONE)

    def _walk(self, motion: int, wish: Wish, seconds: float, source: str) -> Action:
        if Legs in self._robot:
            self._robot[Legs].walk(WALKS[motion], wish.lift)
            if self._body == UPRIGHT:
                self._standing = self._robot[Legs].body_height
        return self._robot[Driving].drive(wish.velocity, lifetime=seconds, source=source)

    def _hold(self, body: BodyPose) -> None:
        """Walk so held; a frame that wants what the last one wanted changes nothing."""
        if body != self._body and Legs in self._robot:
            self._robot[Legs].hold(body, duration=WATCHDOG, source=SOURCE)
            self._body = body

    @property
    def _risen(self) -> float:
        """How much of getting up is done; unknown is nothing."""
        way = self._standing - self._low
        return max(0.0, min(0.99, (self._robot[Legs].body_height - self._low) / way)) if way > 0.01 else 0.0

    def end_servo(self) -> Executed:
        """The last frame: brake and stand."""
        if self._servo:
            self._servo.cancel()
        return Executed(MotionCode.DONE)

    async def carry_out(self, motion: int, wish: Wish) -> MotionCode:
        """A motion to its end, and what must come before it; goes on when nobody waits for it any more."""
        if refusal := self.check(motion, wish):
            return refusal
        task = asyncio.get_running_loop().create_task(self._go_through(motion, wish), name=f"motion {motion}")
        if motion != Motion.EMERGENCY_STOP:
            self._sequences.add(task)
            task.add_done_callback(self._sequences.discard)
        return await asyncio.shield(task)

    def close(self) -> None:
        """Stop the servo; what was begun with a result ends by itself, but nothing follows it."""
        self.end_servo()
        for sequence in self._sequences:
            sequence.cancel()

    async def _go_through(self, motion: int, wish: Wish) -> MotionCode:
        before = [(number, NOTHING_SPECIAL) for number in self._leading_to(motion)]
        code = MotionCode.DONE
        for number, wanted in [*before, (motion, wish)]:
            try:
                action = self._begin(number, wanted)
            except RobotError as error:
                return told(error).motion
            code = await self._ended(action) if action else MotionCode.DONE
            if code is not MotionCode.DONE:
                break
        return code

    def _leading_to(self, motion: int) -> list[int]:
        """What must come first in the present posture: standing up, sitting down."""
        posture, first = self.posture, []
        if _begins_in(motion) == {Posture.SITTING} and posture is not Posture.SITTING:
            first = [int(Motion.SIT_DOWN)]
        if posture not in _begins_in(first[0] if first else motion):
            first.insert(0, int(Motion.STAND_UP))
        return first

    async def _ended(self, action: Action) -> MotionCode:
        """Wait for the end of a motion, and how that is told."""
        if await action.done() is ActionStatus.SUCCEEDED:
            return MotionCode.DONE
        if self.posture is Posture.LIMP:
            return MotionCode.EMERGENCY_STOPPED
        return told(action.error).motion if action.error else MotionCode.EXECUTION

    def check(self, motion: int, wish: Wish) -> MotionCode | None:
        """Why ``carry_out`` would refuse; None if it would not."""
        if refusal := self._refusal(motion):
            return refusal
        if motion not in KNOWN or (motion in FIGURES.keys() | POSES.keys() and Legs not in self._robot):
            return MotionCode.UNSUPPORTED
        given, free = wish.seconds > 0, motion in POSES and not POSES[motion][1]
        if not 0 <= wish.seconds <= DURATION_MAX or (not free and given == (motion in FIXED_TIME)):
            return MotionCode.PARAMETERS
        if motion == Motion.EMERGENCY_STOP or (motion == Motion.LIE_DOWN and self._last in DANCES):
            return None
        serving = _under_way(self._rising) or (_under_way(self._servo) and motion != Motion.WALK_STAND)
        return MotionCode.BUSY if self._busy or serving else None

    @property
    def _busy(self) -> bool:
        return _under_way(self._performing) or any(not task.done() for task in self._sequences)

    def _begin(self, motion: int, wish: Wish) -> Action | None:
        """None: done at once."""
        robot = self._robot
        match motion:
            case Motion.EMERGENCY_STOP:
                self._stop()
                return None
            case Motion.STAND_UP if Legs not in robot:
                return None
            case Motion.STAND_UP:
                action = robot[Legs].stand(source=SOURCE)
                self._body = UPRIGHT
            case Motion.LIE_DOWN | Motion.LIE_DOWN_PASSIVE:
                action = robot[Legs].lie_down(source=SOURCE)
            case Motion.WALK_STAND:
                action = robot[Driving].drive(Twist(), lifetime=WATCHDOG, source=SOURCE)
            case _ if motion in FIGURES:
                action = robot[Legs].perform(FIGURES[motion], source=SOURCE)
            case _ if motion in POSES:
                relative, _ = POSES[motion]
                seconds = wish.seconds or POSE_TIME
                action = robot[Legs].hold(wish.body, duration=seconds, relative=relative, source=SOURCE)
            case _:
                action = self._walk(motion, wish, wish.seconds or PASSIVE_TROT, SOURCE)
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
        """What the robot's state does not allow."""
        if self.posture is Posture.LIMP and motion not in ALLOWED_WHEN_STOPPED:
            return MotionCode.EMERGENCY_STOPPED
        if motion in ALLOWED_ON_LOW_BATTERY:
            return None
        if self.state is MachineState.ACTIVE:
            if Health in self._robot and self._robot[Health].has(MOTOR_ALARM):
                return MotionCode.MOTOR_OFFLINE
            return self._unfit() if motion in FIGURES else None
        return MotionCode.LOW_BATTERY if self.state is MachineState.PROTECTED else MotionCode.STATE

    def _unfit(self) -> MotionCode | None:
        """Why the body should not jump and dance now."""
        robot = self._robot
        if Battery in robot and robot[Battery].state.supply is Supply.WIRE:
            return MotionCode.CHARGING
        if Motors in robot and robot[Motors].hottest > robot[Motors].hot:
            return MotionCode.MOTOR_HOT
        return None


def _begins_in(motion: int) -> Set[Posture]:
    if motion in FIGURES:
        return MOTIONS[FIGURES[motion]].before
    return {Posture.STANDING} if motion in MAY_LAST else set(Posture)


def _under_way(action: Action | None) -> bool:
    return action is not None and not action.status.ended
