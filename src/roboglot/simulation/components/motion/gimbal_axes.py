"""The two axes of a gimbal over time: held against the body's motion, turned to their aims."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated

from msgspec import Meta, Struct

from roboglot.kernels.layouts import (
    BATCHED,
    GIMBAL_ACCELERATION,
    GIMBAL_HIGHEST,
    GIMBAL_HULL_TURNS,
    GIMBAL_HULL_YAW,
    GIMBAL_LOWEST,
    GIMBAL_RATE,
    GIMBAL_SPEED_MAX,
    GIMBAL_WIDTH,
    GIMBAL_YAW,
    GIMBALS,
    HULL_WIDTH,
    SINGLE,
    USE,
)
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.gimbal import FollowMode, GimbalFrame
from roboglot.model.components.sensing.imu import Imu
from roboglot.model.errors import Unreachable
from roboglot.model.geometry import Twist, wrap_angle
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.axis_motors import SETTLED, Axis
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.hull_state import LEVEL
from roboglot.simulation.bodies.hull_state import TABLE as HULLS
from roboglot.simulation.bodies.quantities import Offset, Positive
from roboglot.simulation.bodies.tables import BatchedControl, Control, RobotTables, TickStage
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.values import dataclass

FOLLOWING = 6.0  # 1/s: the gimbal's turn rate back to the chassis' front, per rad of offset
STEERING = 4.0  # 1/s: the same of a chassis that follows the gimbal
THERE = 0.002  # rad: tolerance of a goal


class GimbalSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Crossing of the axes (m), range up, down and sideways (rad), speed (rad/s) and acceleration (rad/s2)."""

    forward: Offset
    above_belly: Offset
    up: Annotated[float, Meta(gt=0, lt=1.6)]
    down: Annotated[float, Meta(gt=0, lt=1.6)]
    sideways: Positive
    speed: Positive
    acceleration: Positive


@dataclass(frozen=True, slots=True)
class Aim:
    """Aim of an axis: go to ``goal`` (rad) at up to ``speed`` (rad/s); without a goal, keep turning at ``speed``."""

    goal: float | None
    speed: float
    frame: GimbalFrame = GimbalFrame.WORLD


UNAIMED = (None, None)
TABLE = "gimbal"


class GimbalAxes:
    """Angles of the axes relative to the body; an axis without an aim keeps its direction in the world.

    ``lean``: the body's pitch in the gimbal's direction, rad.
    """

    def __init__(self, section: GimbalSection, hull: Hull, base: SimulatedBase, robot: Robot) -> None:
        self._hull, self._base, self._robot = hull, base, robot
        self._top_speed = section.speed
        self.pitch = Axis(-section.up, section.down, section.acceleration)
        self._yaw = Axis(-section.sideways, section.sideways, section.acceleration)
        self.index = hull.robot_rows.index
        self._row = row = hull.robot_rows.row(TABLE, GIMBAL_WIDTH)
        row[USE], row[GIMBAL_SPEED_MAX], row[GIMBAL_ACCELERATION] = SINGLE, section.speed, section.acceleration
        row[GIMBAL_LOWEST], row[GIMBAL_HIGHEST] = self._yaw.lowest, self._yaw.highest
        self._aims: tuple[Aim | None, Aim | None] = UNAIMED  # of pitch and yaw
        self.mode = FollowMode.CHASSIS_LEAD
        self.suspended = False
        robot.actuators.on_held.append(self._power)
        self._resting = False
        self.displaced()
        self.lean = 0.0

    @property
    def yaw(self) -> Axis:
        """The yaw axis as it is now."""
        self._yaw.position, self._yaw.rate = self._row[GIMBAL_YAW], self._row[GIMBAL_RATE]
        return self._yaw

    @property
    def _since_start(self) -> float:
        """The body's true rotation since the start, to count whole turns, rad."""
        return self._row[GIMBAL_HULL_TURNS]

    def _disturb(self) -> None:
        """Have the next tick computed alone: what the gimbal does has changed."""
        self._hull.robot_rows.tables.before_change()
        self._resting, self._row[USE] = False, SINGLE

    def set_mode(self, mode: FollowMode) -> None:
        """Set which of gimbal and chassis follows the other."""
        self.mode = mode
        self._disturb()
        self._base.steer(None)

    def suspend(self) -> None:
        """Cut the motors: the axes keep their angles to the body."""
        self.suspended = True
        self._power()

    def resume(self) -> None:
        """Switch the motors on again."""
        self.suspended = False
        self._power()

    @property
    def _limp(self) -> bool:
        """True without power: suspended, or the robot holds all its actuators."""
        return self.suspended or self._robot.actuators.held

    def _power(self) -> None:
        """Note that the motors may have lost or regained their power."""
        if self._limp:
            self.halt()
            self.pitch.rate = self._row[GIMBAL_RATE] = 0.0
            self._base.steer(None)
        else:
            self._disturb()

    def aim(self, pitch: Aim | None, yaw: Aim | None) -> None:
        """Set the axes' aims; None: keep the direction in the world."""
        self._aims = pitch, yaw
        self._disturb()

    def halt(self) -> None:
        """Stop both axes, which keep their directions in the world."""
        self.aim(None, None)

    def arrived(self) -> bool:
        """Return whether all axes are at their goals. Raises Unreachable if one is at its end short of its goal."""
        short = 0.0
        for axis, goal in ((self.pitch, self._goal(0)), (self.yaw, self._goal(1))):
            if goal is None or not (axis.rate or abs(axis.position - goal) > THERE):
                continue
            if reaches(axis, goal) or axis.position not in (axis.lowest, axis.highest):
                return False
            short = max(short, abs(axis.position - goal))
        if short:
            raise Unreachable(f"the gimbal is at the end of its travel, {math.degrees(short):.1f} degrees short")
        return True

    @property
    def heading(self) -> float:
        """Heading of the body since power-on by the gyro, rad, not wrapped."""
        if Imu not in self._robot:
            return self._since_start
        measured = self._robot[Imu].reading.orientation.yaw
        return self._since_start + wrap_angle(measured - self._since_start)

    def _goal(self, index: int) -> float | None:
        """Return an axis' goal as a joint angle, rad; None: no goal, or the yaw in CHASSIS_LEAD."""
        aim = self._aims[index]
        if aim is None or aim.goal is None or (index and self.mode is FollowMode.CHASSIS_LEAD):
            return None
        if aim.frame is GimbalFrame.BODY:
            return aim.goal
        return aim.goal - (self.heading if index else self.lean)

    def control(self, seconds: float) -> None:
        """Compensate the body's motion, follow or steer the chassis, turn to the aims; before the base's control."""
        hull, row, yaw = self._hull, self._row, self.yaw
        turn, row[GIMBAL_HULL_YAW] = hull.turned - row[GIMBAL_HULL_YAW], hull.turned
        if self._resting and row[USE] == SINGLE and not turn and hull.tilt is LEVEL:
            return
        row[GIMBAL_HULL_TURNS] += turn
        if hull.tilt is LEVEL and self._plain and not self.lean:
            self._follow_body(yaw, turn, seconds)
        elif not self._move(yaw, turn, seconds):
            return
        row[GIMBAL_YAW], row[GIMBAL_RATE] = yaw.position, yaw.rate
        hull.gaze = self.pitch.position, yaw.position
        if self.mode is FollowMode.GIMBAL_LEAD:
            self._steer(yaw.position)

    def _move(self, yaw: Axis, turn: float, seconds: float) -> bool:
        """Turn both axes by a tick, while the body has turned by ``turn`` (rad); return whether they have power."""
        hull, self._row[USE] = self._hull, SINGLE
        lean = 0.0 if hull.tilt is LEVEL else _lean(hull.tilt, yaw.position)
        leaning, self.lean = lean - self.lean, lean
        if self._limp:
            self._resting = True
            return False
        if turn or self._aims[1] is not None or yaw.position or yaw.rate:
            self._advance(1, yaw, -turn, seconds)
        if leaning or self._aims[0] is not None or self.pitch.rate:
            self._advance(0, self.pitch, -leaning, seconds)
        rested = self._aims == UNAIMED and not self.pitch.rate and not yaw.rate
        centred = self.mode is FollowMode.CHASSIS_LEAD and not yaw.position
        self._resting = rested and (centred or self.mode is FollowMode.FREE)
        return True

    @property
    def _plain(self) -> bool:
        """True if the gimbal only follows the chassis."""
        unaimed = self._aims == UNAIMED and not self.pitch.rate
        return unaimed and self.mode is FollowMode.CHASSIS_LEAD and not self._limp

    def _follow_body(self, yaw: Axis, turn: float, seconds: float) -> None:
        """Compensate a turn of the body (rad) and return to its front; the kernel does the same from now on."""
        yaw.trail(-turn, FOLLOWING, self._top_speed, seconds)
        self._resting, self._row[USE] = not yaw.position and not yaw.rate, BATCHED

    def displaced(self) -> None:
        """Note that the robot was put elsewhere, together with its axes."""
        self._row[GIMBAL_HULL_YAW] = self._hull.turned

    def _advance(self, index: int, axis: Axis, held: float, seconds: float) -> None:
        """Move one axis; ``held``: the turn (rad) that keeps its direction in spite of the body's motion."""
        aim, led = self._aims[index], index == 1 and self.mode is FollowMode.CHASSIS_LEAD
        if held and (aim is None or led or aim.goal is None or aim.frame is GimbalFrame.WORLD):
            axis.shift(held)
        if led:
            self._follow(axis, seconds)
        elif aim is not None and (goal := self._goal(index)) is not None:
            axis.approach(goal, aim.speed, seconds)
        elif aim is not None or axis.rate:
            axis.run(aim.speed if aim is not None else 0.0, seconds)

    def _follow(self, axis: Axis, seconds: float) -> None:
        """Return to the body's front, at a rate that grows with the offset."""
        axis.trail(0.0, FOLLOWING, self._top_speed, seconds)

    def _steer(self, off: float) -> None:
        """Turn the base after the gimbal, which is ``off`` its front (rad).

        Not while an action other than manual driving uses the base.
        """
        drivers = self._robot.actions.running(BASE)
        if self._base.locks.held or not all(isinstance(driver.goal, Twist | WheelSpeeds) for driver in drivers):
            self._base.steer(None)
            return
        top = self._base.limits.twist.yaw
        self._base.steer(0.0 if abs(off) < SETTLED else max(-top, min(top, STEERING * off)))


def control_all(tables: RobotTables, gimbals: Sequence[tuple[GimbalAxes, Control]]) -> BatchedControl:
    """Return a function that controls all gimbals, in one call of the kernel as far as they follow their bodies."""
    hulls, table = tables.table(HULLS, HULL_WIDTH), tables.table(TABLE, GIMBAL_WIDTH)
    return tables.control(
        {axes.index: control for axes, control in gimbals},
        lambda kernels, seconds: kernels.turn_gimbals(hulls, table, FOLLOWING, SETTLED, seconds, tables.others),
        TickStage(GIMBALS, (table,), (FOLLOWING, SETTLED)),
    )


def reaches(axis: Axis, goal: float) -> bool:
    """True if the axis can turn to ``goal`` (rad)."""
    return axis.lowest - 1e-9 <= goal <= axis.highest + 1e-9


def _lean(tilt: tuple[float, float], yaw: float) -> float:
    """Return the body's pitch in the direction ``yaw``, rad."""
    roll, pitch = tilt
    return pitch * math.cos(yaw) - roll * math.sin(yaw)
