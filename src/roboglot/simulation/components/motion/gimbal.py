"""A gimbal of two motors, stabilised against the body's turning and tilting; in GIMBAL_LEAD it steers the base.

Kinematics only: the motors are strong enough for any load.
"""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable

import numpy as np
from numpy.typing import NDArray

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.gimbal import GIMBAL, FollowMode, Gimbal, GimbalAngles, GimbalFrame, GimbalLimits
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import bounded
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import move
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.motion.gimbal_axes import Aim, GimbalAxes, GimbalSection, control_all, reaches

Floats = NDArray[np.float64]


class SimulatedGimbal(Gimbal):
    """Gimbal whose commands aim the axes or keep them turning."""

    def __init__(self, section: GimbalSection, hull: Hull, base: SimulatedBase, robot: Robot) -> None:
        side = section.sideways
        self.limits = GimbalLimits(GimbalAngles(-section.up, -side), GimbalAngles(section.down, side), section.speed)
        self._section, self._hull, self._robot = section, hull, robot
        self.axes = GimbalAxes(section, hull, base, robot)
        self._turning: Action | None = None  # the latest action of set_speed

    @property
    def angles(self) -> GimbalAngles:
        return GimbalAngles(self.axes.pitch.position, self.axes.yaw.position)

    @property
    def attitude(self) -> GimbalAngles:
        axes = self.axes
        return GimbalAngles(axes.pitch.position + axes.lean, axes.yaw.position + axes.heading)

    @property
    def mode(self) -> FollowMode:
        return self.axes.mode

    def set_mode(self, mode: FollowMode) -> None:
        self.axes.set_mode(mode)

    @property
    def suspended(self) -> bool:
        return self.axes.suspended

    def suspend(self) -> None:
        for action in self._robot.actions.running(GIMBAL):
            action.cancel("the gimbal was suspended")
        self.axes.suspend()

    def resume(self) -> None:
        self.axes.resume()

    def set_speed(self, pitch: float, yaw: float, *, source: str = "") -> Action:
        if not (math.isfinite(pitch) and math.isfinite(yaw)):
            raise InvalidGoal("a speed must be finite")
        top = self.limits.speed
        speeds = GimbalAngles(bounded(pitch, top), bounded(yaw, top))
        action = self._turning
        if action and action.may_go_on(source) and action.status is ActionStatus.EXECUTING and not action.paused:
            action.goal = speeds
            return action

        async def run(action: Action) -> None:
            def turn() -> bool:
                goal = action.goal
                assert isinstance(goal, GimbalAngles)
                self.axes.aim(Aim(None, goal.pitch), Aim(None, goal.yaw))
                return goal == GimbalAngles()

            await move(action, self._robot.clock, lambda: None, turn, self.axes.halt)

        self._turning = self._start("turn gimbal", run, speeds, source)
        return self._turning

    def move_to(
        self,
        *,
        pitch: float | None = None,
        yaw: float | None = None,
        frame: GimbalFrame = GimbalFrame.BODY,
        pitch_speed: float | None = None,
        yaw_speed: float | None = None,
        source: str = "",
    ) -> Action:
        for axis, goal in ((self.axes.pitch, pitch), (self.axes.yaw, yaw)):
            if goal is not None and (
                not math.isfinite(goal) or (frame is GimbalFrame.BODY and not reaches(axis, goal))
            ):
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
            raise InvalidGoal("an angle must be finite")
        up, side = (
            axis.position + offset if offset else None
            for axis, offset in ((self.axes.pitch, pitch), (self.axes.yaw, yaw))
        )
        return self._move_to(up, side, GimbalFrame.BODY, self._top(pitch_speed), self._top(yaw_speed), source)

    def recenter(self, *, source: str = "") -> Action:
        speed = self.limits.speed / 3
        return self._move_to(0.0, 0.0, GimbalFrame.BODY, speed, speed, source)

    def sight_line(self) -> tuple[Floats, Floats]:
        """Return the crossing of the axes (m) and the direction of view (unit vector), in the world frame."""
        hull = self._hull
        pivot, ahead = hull.to_world(np.array((self.pivot, self.orientation[:, 0])))
        return pivot + hull.position, ahead

    @property
    def pivot(self) -> tuple[float, float, float]:
        """Crossing of the axes in base_link, m."""
        return self._section.forward, 0.0, self._hull.belly + self._section.above_belly

    @property
    def orientation(self) -> Floats:
        """Rotation from the gimbal's frame to base_link."""
        return rotation((0.0, self.axes.pitch.position), self.axes.yaw.position)

    # -- actions --

    def _move_to(
        self,
        pitch: float | None,
        yaw: float | None,
        frame: GimbalFrame,
        pitch_speed: float,
        yaw_speed: float,
        source: str,
    ) -> Action:
        goals = GimbalAngles(pitch or 0.0, yaw or 0.0)

        async def run(action: Action) -> None:
            def begin() -> None:
                self.axes.aim(
                    None if pitch is None else Aim(pitch, pitch_speed, pitch_frame),
                    None if yaw is None else Aim(heading, yaw_speed, yaw_frame),
                )

            pitch_frame, yaw_frame = (
                (GimbalFrame.WORLD, GimbalFrame.BODY) if frame is GimbalFrame.STABILIZED else (frame, frame)
            )
            heading = yaw
            if heading is not None and self.axes.mode is FollowMode.GIMBAL_LEAD and yaw_frame is GimbalFrame.BODY:
                # In the world, or else it would run after the next body.
                heading, yaw_frame = heading + self.axes.heading, GimbalFrame.WORLD
            await move(action, self._robot.clock, begin, self.axes.arrived, self.axes.halt)

        return self._start("move gimbal", run, goals, source)

    def _start(self, name: str, run: Callable[[Action], Awaitable[None]], goal: GimbalAngles, source: str) -> Action:
        if self.axes.suspended:
            raise Refused("the gimbal is suspended")
        return self._robot.actions.start(name, run, resources={GIMBAL}, goal=goal, source=source, pausable=True)

    def _top(self, speed: float | None) -> float:
        if speed is None:
            return self.limits.speed
        if not speed > 0.0:
            raise InvalidGoal(f"a speed must be above 0, not {speed}")
        return min(speed, self.limits.speed)


def _fit(fit: Fitting) -> SimulatedGimbal:
    return SimulatedGimbal(fit.body[GimbalSection], fit.hull, fit.get(SimulatedBase), fit.robot)


PART = Part(
    name="gimbal",
    interface=Gimbal,
    section=GimbalSection,
    fit=_fit,
    after=("base",),
    control=lambda gimbal, seconds: gimbal.axes.control(seconds),
    control_all=lambda tables, found: control_all(tables, [(gimbal.axes, control) for gimbal, control in found]),
    displaced=lambda gimbal: gimbal.axes.displaced(),
)
