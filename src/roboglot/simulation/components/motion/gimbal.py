"""A gimbal of two motors, stabilised against the body's turning and tilting; in GIMBAL_LEAD it steers the base.

Kinematics in time: the motors are strong enough that the load never matters.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct
from numpy.typing import NDArray

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.gimbal import (
    GIMBAL,
    FollowMode,
    Frame,
    Gimbal,
    GimbalAngles,
    GimbalLimits,
)
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.errors import InvalidGoal, Refused, Unreachable
from roboglot.model.geometry import Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import SETTLED, Axis, move
from roboglot.simulation.bodies.hull import LEVEL, Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Offset, Positive
from roboglot.simulation.components.motion.base import SimulatedBase

Floats = NDArray[np.float64]
FOLLOWING = 6.0  # 1/s: turn rate of the gimbal back to the chassis' front, per rad that it is off
STEERING = 4.0  # 1/s: the same for a chassis that follows the gimbal
THERE = 0.002  # rad: near enough to a goal


class GimbalSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Where its axes cross, how far up, down and to both sides it turns, speed and acceleration of both axes."""

    forward: Offset
    above_belly: Offset
    up: Annotated[float, Meta(gt=0, lt=1.6)]
    down: Annotated[float, Meta(gt=0, lt=1.6)]
    sideways: Positive
    speed: Positive
    acceleration: Positive


@dataclass(frozen=True, slots=True)
class _Aim:
    """One axis: go to ``goal`` (rad) at up to ``speed`` (rad/s), or without a goal keep turning at ``speed``."""

    goal: float | None
    speed: float
    frame: Frame = Frame.WORLD


UNAIMED = (None, None)


class SimulatedGimbal(Gimbal):
    """Keeps the axes' angles relative to the body; what is not aimed stays where it points in the world."""

    def __init__(self, section: GimbalSection, hull: Hull, base: SimulatedBase, robot: Robot) -> None:
        side = section.sideways
        self.limits = GimbalLimits(GimbalAngles(-section.up, -side), GimbalAngles(section.down, side), section.speed)
        self._top_speed = section.speed
        self._section, self._hull, self._base, self._robot = section, hull, base, robot
        self._pitch = Axis(-section.up, section.down, section.acceleration)
        self._yaw = Axis(-side, side, section.acceleration)
        self._aims: tuple[_Aim | None, _Aim | None] = UNAIMED  # of pitch and yaw
        self._turning: Action | None = None  # the newest action of set_speed
        self._mode = FollowMode.CHASSIS_LEAD
        self._suspended = False
        self._resting = False
        self._turned = hull.turned
        self._since_start = 0.0  # how far the body really turned, to count whole turns
        self._lean = 0.0  # the body's pitch where the gimbal looks, rad

    @property
    def angles(self) -> GimbalAngles:
        return GimbalAngles(self._pitch.position, self._yaw.position)

    @property
    def attitude(self) -> GimbalAngles:
        return GimbalAngles(self._pitch.position + self._lean, self._yaw.position + self._heading)

    @property
    def mode(self) -> FollowMode:
        return self._mode

    def set_mode(self, mode: FollowMode) -> None:
        self._mode, self._resting = mode, False
        self._base.steer = None

    @property
    def suspended(self) -> bool:
        return self._suspended

    def suspend(self) -> None:
        for action in self._robot.actions.running(GIMBAL):
            action.cancel("the gimbal was suspended")
        self._suspended = True
        self._aim(None, None)
        self._pitch.rate = self._yaw.rate = 0.0
        self._base.steer = None

    def resume(self) -> None:
        self._suspended = self._resting = False

    def set_speed(self, pitch: float, yaw: float, *, source: str = "") -> Action:
        if not (math.isfinite(pitch) and math.isfinite(yaw)):
            raise InvalidGoal("a speed is finite")
        top = self.limits.speed
        speeds = GimbalAngles(max(-top, min(top, pitch)), max(-top, min(top, yaw)))
        action = self._turning
        if action and action.may_go_on(source) and action.status is ActionStatus.EXECUTING and not action.paused:
            action.goal = speeds
            return action

        async def run(action: Action) -> None:
            def turn() -> bool:
                goal: GimbalAngles = action.goal  # type: ignore[assignment]
                self._aim(_Aim(None, goal.pitch), _Aim(None, goal.yaw))
                return goal == GimbalAngles()

            await move(action, self._robot.clock, lambda: None, turn, self._halt)

        self._turning = self._start("turn gimbal", run, speeds, source)
        return self._turning

    def move_to(
        self,
        *,
        pitch: float | None = None,
        yaw: float | None = None,
        frame: Frame = Frame.BODY,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        for axis, goal in ((self._pitch, pitch), (self._yaw, yaw)):
            if goal is not None and (not math.isfinite(goal) or (frame is Frame.BODY and not _reaches(axis, goal))):
                raise InvalidGoal(f"the gimbal turns from {axis.lowest:.3f} to {axis.highest:.3f} rad, not to {goal}")
        return self._move_to(pitch, yaw, frame, self._top(pitch_speed), self._top(yaw_speed), source)

    def move_by(
        self,
        *,
        pitch: float = 0.0,
        yaw: float = 0.0,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        if not (math.isfinite(pitch) and math.isfinite(yaw)):
            raise InvalidGoal("an angle is finite")
        up, side = (
            axis.position + offset if offset else None for axis, offset in ((self._pitch, pitch), (self._yaw, yaw))
        )
        return self._move_to(up, side, Frame.BODY, self._top(pitch_speed), self._top(yaw_speed), source)

    def recenter(self, *, source: str = "") -> Action:
        speed = self.limits.speed / 3
        return self._move_to(0.0, 0.0, Frame.BODY, speed, speed, source)

    def sight_line(self) -> tuple[Floats, Floats]:
        """Where the axes cross, and the direction in which the gimbal looks, world."""
        hull = self._hull
        pivot, ahead = hull.to_world(np.array((self.pivot, self.orientation[:, 0])))
        return pivot + hull.position, ahead

    @property
    def pivot(self) -> tuple[float, float, float]:
        """Where the axes cross, base_link."""
        return self._section.forward, 0.0, self._hull.belly + self._section.above_belly

    @property
    def orientation(self) -> Floats:
        """From the gimbal's frame to base_link."""
        return rotation((0.0, self._pitch.position), self._yaw.position)

    # -- actions -------------------------------------------------------------------------------------------------------

    def _move_to(
        self, pitch: float | None, yaw: float | None, frame: Frame, pitch_speed: float, yaw_speed: float, source: str
    ) -> Action:
        goals = GimbalAngles(pitch or 0.0, yaw or 0.0)

        async def run(action: Action) -> None:
            def begin() -> None:
                self._aim(
                    None if pitch is None else _Aim(pitch, pitch_speed, pitch_frame),
                    None if yaw is None else _Aim(heading, yaw_speed, yaw_frame),
                )

            pitch_frame, yaw_frame = (Frame.WORLD, Frame.BODY) if frame is Frame.STABILIZED else (frame, frame)
            heading = yaw
            if heading is not None and self._mode is FollowMode.GIMBAL_LEAD and yaw_frame is Frame.BODY:
                heading, yaw_frame = heading + self._heading, Frame.WORLD  # else it would run after the body after it
            await move(action, self._robot.clock, begin, self._arrived, self._halt)

        return self._start("move gimbal", run, goals, source)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], goal: GimbalAngles, source: str) -> Action:
        if self._suspended:
            raise Refused("the gimbal is suspended")
        return self._robot.actions.start(name, run, resources={GIMBAL}, goal=goal, source=source)

    def _top(self, speed: float | None) -> float:
        if speed is None:
            return self.limits.speed
        if not speed > 0.0:
            raise InvalidGoal(f"a speed is above 0, not {speed}")
        return min(speed, self.limits.speed)

    def _aim(self, pitch: _Aim | None, yaw: _Aim | None) -> None:
        self._aims, self._resting = (pitch, yaw), False

    def _halt(self) -> None:
        self._aim(None, None)

    def _arrived(self) -> bool:
        """True if every axis is where it is to be; raises Unreachable once one is at its end short of that."""
        short = 0.0
        for axis, goal in ((self._pitch, self._goal(0)), (self._yaw, self._goal(1))):
            if goal is None or not (axis.rate or abs(axis.position - goal) > THERE):
                continue
            if _reaches(axis, goal) or axis.position not in (axis.lowest, axis.highest):
                return False
            short = max(short, abs(axis.position - goal))
        if short:
            raise Unreachable(f"the gimbal is at the end of its travel, {math.degrees(short):.1f} degrees short")
        return True

    # -- time ----------------------------------------------------------------------------------------------------------

    @property
    def _heading(self) -> float:
        """The body's since power-on as the gyro has it, rad, not wrapped."""
        if Imu not in self._robot:
            return self._since_start
        measured = self._robot[Imu].reading.orientation.yaw
        return self._since_start + wrap_angle(measured - self._since_start)

    def _goal(self, index: int) -> float | None:
        """Where the axis is to be, as a joint's angle; in CHASSIS_LEAD only the chassis aims the yaw."""
        aim = self._aims[index]
        if aim is None or aim.goal is None or (index and self._mode is FollowMode.CHASSIS_LEAD):
            return None
        if aim.frame is Frame.BODY:
            return aim.goal
        return aim.goal - (self._heading if index else self._lean)

    def control(self, seconds: float) -> None:
        """Before the base's: hold against the body's last motion, follow or be followed, turn to where it is aimed."""
        hull = self._hull
        turn, self._turned = hull.turned - self._turned, hull.turned
        if self._resting and not turn and hull.tilt is LEVEL:
            return
        self._since_start += turn
        if hull.tilt is LEVEL and self._plain and not self._lean:
            hull.gaze = self._pitch.position, self._follow_body(turn, seconds)
            return
        lean = 0.0 if hull.tilt is LEVEL else _lean(hull.tilt, self._yaw.position)
        leaning, self._lean = lean - self._lean, lean
        if self._suspended:
            return
        if turn or self._aims[1] is not None or self._yaw.position or self._yaw.rate:
            self._advance(1, self._yaw, -turn, seconds)
        if leaning or self._aims[0] is not None or self._pitch.rate:
            self._advance(0, self._pitch, -leaning, seconds)
        hull.gaze = self._pitch.position, self._yaw.position
        if self._mode is FollowMode.GIMBAL_LEAD:
            self._steer()
        rested = self._aims == (None, None) and not self._pitch.rate and not self._yaw.rate
        centred = self._mode is FollowMode.CHASSIS_LEAD and not self._yaw.position
        self._resting = rested and (centred or self._mode is FollowMode.FREE)

    @property
    def _plain(self) -> bool:
        """True if all it does is to follow the chassis."""
        unaimed = self._aims == UNAIMED and not self._pitch.rate
        return unaimed and self._mode is FollowMode.CHASSIS_LEAD and not self._suspended

    def _follow_body(self, turn: float, seconds: float) -> float:
        """Hold the yaw against a turn of the body while coming back to its front; return it."""
        axis = self._yaw
        axis.trail(-turn, FOLLOWING, self._top_speed, seconds)
        self._resting = not axis.position and not axis.rate
        return axis.position

    def displaced(self) -> None:
        """The robot was lifted and put elsewhere: the axes went with it."""
        self._turned = self._hull.turned

    def _advance(self, index: int, axis: Axis, held: float, seconds: float) -> None:
        """Move one axis; ``held`` is how it turns to point where it did before the body moved."""
        aim, led = self._aims[index], index == 1 and self._mode is FollowMode.CHASSIS_LEAD
        if held and (aim is None or led or aim.goal is None or aim.frame is Frame.WORLD):
            axis.shift(held)
        if led:
            self._follow(axis, seconds)
        elif aim is not None and (goal := self._goal(index)) is not None:
            axis.approach(goal, aim.speed, seconds)
        elif aim is not None or axis.rate:
            axis.run(aim.speed if aim is not None else 0.0, seconds)

    def _follow(self, axis: Axis, seconds: float) -> None:
        """Come back to the body's front, the faster the further off."""
        axis.trail(0.0, FOLLOWING, self._top_speed, seconds)

    def _steer(self) -> None:
        """Have the base turn after the gimbal, unless something else than hands drives it."""
        drivers = self._robot.actions.running(BASE)
        if self._base.locks.held or not all(isinstance(driver.goal, Twist | WheelSpeeds) for driver in drivers):
            self._base.steer = None
            return
        off, top = self._yaw.position, self._base.limits.twist.yaw
        self._base.steer = 0.0 if abs(off) < SETTLED else max(-top, min(top, STEERING * off))


def _reaches(axis: Axis, goal: float) -> bool:
    return axis.lowest - 1e-9 <= goal <= axis.highest + 1e-9


def _lean(tilt: tuple[float, float], yaw: float) -> float:
    """The body's pitch in the direction ``yaw``."""
    roll, pitch = tilt
    return pitch * math.cos(yaw) - roll * math.sin(yaw)


def _fit(fit: Fitting) -> SimulatedGimbal:
    return SimulatedGimbal(fit.body[GimbalSection], fit.hull, fit.get(SimulatedBase), fit.robot)


PART = Part(
    name="gimbal",
    interface=Gimbal,
    section=GimbalSection,
    fit=_fit,
    after=("base",),
    control=SimulatedGimbal.control,
    displaced=SimulatedGimbal.displaced,
)
