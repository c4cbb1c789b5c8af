"""Motions on the model: servo frames with their watchdog, motions with a result. Knows no message."""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.legs import Legs, Posture
from roboglot.model.errors import RobotError
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.protocols.cyberdog.chapters.motion.climbing import sees
from roboglot.protocols.cyberdog.chapters.motion.motion_start import SOURCE, WATCHDOG, MotionRequest, MotionStart
from roboglot.protocols.cyberdog.chapters.motion.motion_states import begins_in, entered, of_another, under_way
from roboglot.protocols.cyberdog.chapters.motion.motion_table import (
    DANCED,
    DANCES,
    KNOWN,
    NUMBERS,
    ON_LEGS,
    POSES,
    PRESETS,
    SEEING,
    SERVO_POSES,
    STATES,
    USERS,
    WALK_STANDS,
    WALKS,
)
from roboglot.protocols.cyberdog.chapters.motion.readiness import machine_state, posture_of, refusal_of
from roboglot.protocols.cyberdog.chapters.motion.reasons import asks_too_much, lasts_as_allowed
from roboglot.protocols.cyberdog.errors import codes_of
from roboglot.values import dataclass
from roboglot.wire.cyberdog.chapters.motion.motion import Motion, MotionCode, SwitchStatus
from roboglot.wire.cyberdog.codes import MachineState

NOTHING_SPECIAL = MotionRequest()
MOVING = 0.01  # m/s or rad/s from which the body counts as walking


@dataclass(frozen=True, slots=True)
class Executed:
    """Result of a servo frame; ``share`` (0..1) of the way to the commanded motion."""

    code: MotionCode
    status: SwitchStatus = SwitchStatus.NORMAL
    share: float = 1.0


class Gaits:
    """One motion at a time, by a servo's frames or by a command with a result."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._start = MotionStart(robot)
        self._last: int = Motion.STAND_UP  # the motion commanded last
        self._servo: Action | None = None
        self._rising: Action | None = None  # the action that gets up for a servo frame
        self._performing: Action | None = None
        self._low = 0.0  # m: the belly's height, and the time, when it began to get up
        self._stops = 0  # emergency stops so far
        self._sequences: set[asyncio.Task[MotionCode]] = set()

    @property
    def state(self) -> MachineState:
        """State of the robot, by charge, power mode and updates."""
        return machine_state(self._robot)

    @property
    def posture(self) -> Posture:
        """Current posture; a body without legs always stands."""
        return posture_of(self._robot)

    @property
    def motion(self) -> int:
        """Number of the current motion, no matter which client commanded it."""
        if Legs in self._robot and (figure := self._robot[Legs].performing):
            return NUMBERS.get(figure, int(Motion.STAND_UP))
        if self.posture is not Posture.CHANGING and (state := entered(self._robot)):
            return state
        if self._last in DANCED and under_way(self._performing):
            return self._last
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
            ours = under_way(self._servo) or under_way(self._performing)
            return self._last if ours and self._last in WALKS else Motion.TROT_SLOW
        return Motion.WALK_STAND if self._last in WALKS else Motion.STAND_UP

    def servo(self, motion: int, request: MotionRequest) -> Executed:
        """Execute one servo frame: keep its velocity until the next, or for WATCHDOG seconds.

        A robot that does not stand gets up first; frames in the meantime are accepted without effect.
        """
        if refusal := refusal_of(self._robot, motion):
            status = SwitchStatus.EMERGENCY_STOPPED if refusal is MotionCode.EMERGENCY_STOPPED else SwitchStatus.NORMAL
            return Executed(refusal, SwitchStatus.LOW_BATTERY if refusal is MotionCode.LOW_BATTERY else status)
        if not self._frames_may_ask_for(motion):
            return Executed(MotionCode.UNSUPPORTED)
        if asks_too_much(motion, request):
            return Executed(MotionCode.PARAMETERS)
        if self.busy:
            return Executed(MotionCode.BUSY)
        if under_way(self._rising):
            return Executed(MotionCode.DONE, SwitchStatus.CHANGING, self._risen)
        try:
            if self.posture is not Posture.STANDING:
                self._low = self._robot[Legs].body_height
                self._last, self._rising = Motion.STAND_UP, self._robot[Legs].stand(source=SOURCE)
                return Executed(MotionCode.DONE, SwitchStatus.CHANGING, 0.0)
            if motion in SERVO_POSES:
                relative, _ = POSES[motion]
                self._start.hold(request.body, relative=relative)
            else:
                self._start.hold(request.body)
                self._servo = self._start.walk(motion, request, WATCHDOG, f"{SOURCE} servo")
        except RobotError as error:
            return Executed(codes_of(error).motion)
        self._last = motion
        return Executed(MotionCode.DONE)

    def _frames_may_ask_for(self, motion: int) -> bool:
        if motion in SERVO_POSES:
            return Legs in self._robot
        return motion in WALKS and (motion not in SEEING or sees(self._robot))

    @property
    def _risen(self) -> float:
        """Progress of standing up, 0..0.99; 0 if unknown."""
        way = self._start.standing - self._low
        return max(0.0, min(0.99, (self._robot[Legs].body_height - self._low) / way)) if way > 0.01 else 0.0

    def end_servo(self) -> Executed:
        """Handle the last frame: brake and stand."""
        if self._servo:
            self._servo.cancel()
        return Executed(MotionCode.DONE)

    async def _leave_servo(self) -> None:
        """Leave servo mode; return once the robot has braked."""
        servo = self._servo
        if servo is not None and under_way(servo):
            servo.cancel("a motion with a result follows")
            await servo.done()

    def calibrate(self) -> Executed:
        """Lie down and release the motors in the background; repeated frames change nothing."""
        if Legs not in self._robot:
            return Executed(MotionCode.UNSUPPORTED)
        if self.posture is Posture.LIMP or self.busy:
            return Executed(MotionCode.DONE if self.posture is Posture.LIMP else MotionCode.BUSY)
        self.end_servo()
        self._follow_up(self._calibrate(), "calibration")
        return Executed(MotionCode.DONE, SwitchStatus.CHANGING, 0.0)

    async def _calibrate(self) -> MotionCode:
        code = await self._go_through(Motion.LIE_DOWN, NOTHING_SPECIAL)
        if code is MotionCode.DONE:
            self._start.stop()
        return code

    async def carry_out(self, motion: int, request: MotionRequest) -> MotionCode:
        """Perform a motion to its end, with the motions that must precede it; continues without a waiting client."""
        if refusal := self.check(motion, request):
            return refusal
        if motion == Motion.EMERGENCY_STOP:
            return await self._go_through(motion, request)
        return await asyncio.shield(self._follow_up(self._go_through(motion, request), f"motion {motion}"))

    def _follow_up(self, doing: Coroutine[object, object, MotionCode], name: str) -> asyncio.Task[MotionCode]:
        task = asyncio.get_running_loop().create_task(doing, name=name)
        self._sequences.add(task)
        task.add_done_callback(self._sequences.discard)
        return task

    def close(self) -> None:
        """Stop the servo; a motion with a result ends by itself, and no further one follows."""
        self.end_servo()
        for sequence in self._sequences:
            sequence.cancel()

    async def _go_through(self, motion: int, request: MotionRequest) -> MotionCode:
        stops, limp = self._stops, self.posture is Posture.LIMP
        if motion == Motion.EMERGENCY_STOP:
            self._stops = stops = stops + 1
        else:
            await self._leave_servo()
        before = [(number, NOTHING_SPECIAL) for number in self._leading_to(motion)]
        code = MotionCode.DONE
        for number, wanted in [*before, (motion, request)]:
            if self._stops != stops or (self.posture is Posture.LIMP and not limp):
                return MotionCode.EMERGENCY_STOPPED  # in the meantime: it must not get up again
            try:
                action = self._begin(number, wanted)
            except RobotError as error:
                return codes_of(error).motion
            looking = self._start.looking(number, wanted)
            try:
                code = await self._ended(action) if action else MotionCode.DONE
            finally:
                if looking:
                    looking.cancel()
            if code is not MotionCode.DONE:
                break
        return code

    def _leading_to(self, motion: int) -> list[int]:
        """Return the motions needed first from the current posture: standing up, sitting down."""
        posture, first = self.posture, []
        if begins_in(motion) == {Posture.SITTING} and posture is not Posture.SITTING:
            first = [int(Motion.SIT_DOWN)]
        if posture not in begins_in(first[0] if first else motion):
            first.insert(0, int(Motion.STAND_UP))
        return first

    async def _ended(self, action: Action) -> MotionCode:
        """Wait for the end of a motion; return its code."""
        if await action.done() is ActionStatus.SUCCEEDED:
            return MotionCode.DONE
        if self.posture is Posture.LIMP:
            return MotionCode.EMERGENCY_STOPPED
        return codes_of(action.error).motion if action.error else MotionCode.EXECUTION

    def check(self, motion: int, request: MotionRequest) -> MotionCode | None:
        """Return the code with which ``carry_out`` would refuse; None if it would not."""
        if refusal := refusal_of(self._robot, motion):
            return refusal
        if not _is_supported(self._robot, motion):
            return MotionCode.UNSUPPORTED
        if motion in STATES:
            return MotionCode.BANNED
        if not lasts_as_allowed(motion, request.seconds) or asks_too_much(motion, request):
            return MotionCode.PARAMETERS
        if motion in PRESETS or (motion in USERS and not self._robot[Legs].choreography.steps):
            return MotionCode.NO_SEQUENCE
        if motion == Motion.EMERGENCY_STOP or (motion == Motion.LIE_DOWN and self._last in DANCES):
            return None
        serving = of_another(self._rising) or (of_another(self._servo) and motion not in WALK_STANDS)
        return MotionCode.BUSY if self.busy or serving else None

    @property
    def busy(self) -> bool:
        """True while a motion with a result is under way."""
        return under_way(self._performing) or any(not task.done() for task in self._sequences)

    def _begin(self, motion: int, request: MotionRequest) -> Action | None:
        """Begin a motion and record it; None: it was done at once."""
        action = self._start.begin(motion, request)
        if action is not None:
            self._last, self._performing = motion, action
        return action


def _is_supported(robot: Robot, motion: int) -> bool:
    """True if the robot has what the motion needs."""
    return motion in KNOWN and (motion not in ON_LEGS or Legs in robot) and (motion not in SEEING or sees(robot))
