"""Place, motion and drive of one robot's body, kept in its row. Truth, world frame."""

from __future__ import annotations

import math

from roboglot.kernels.layouts import (
    HULL_A,
    HULL_ANGULAR_STEP,
    HULL_DRIVE_X,
    HULL_DRIVE_YAW,
    HULL_GIMBAL_PITCH,
    HULL_GOAL_X,
    HULL_HELD,
    HULL_LAST_V,
    HULL_LINEAR_STEP,
    HULL_Q,
    HULL_RADIUS,
    HULL_TILTED,
    HULL_TORSO,
    HULL_TORSO_CONTROL,
    HULL_TORSO_V,
    HULL_UNDERSIDE,
    HULL_UNDRIVEN,
    HULL_V,
    HULL_VX,
    HULL_WALLS,
    HULL_WHEEL_X,
    HULL_WIDTH,
    HULL_X,
    HULL_Y,
    HULL_YAW,
    HULL_Z,
)
from roboglot.model.geometry import LEVEL as STRAIGHT
from roboglot.model.geometry import Orientation, Pose, Twist, wrap_angle
from roboglot.simulation.bodies.tables import RobotRows

LEVEL = (0.0, 0.0)
TABLE = "hull"
Motion = tuple[float, float, float, float]


class HullState:
    """Numbers of a hull. Kernels may update them, so the properties read them each time."""

    def __init__(self, robot_rows: RobotRows) -> None:
        self.robot_rows = robot_rows
        self._row = robot_rows.row(TABLE, HULL_WIDTH)
        self._posed: tuple[float, Pose] | None = None  # yaw without wrapping, and the pose made of it
        self._tilt, self._attitude = LEVEL, STRAIGHT
        self._hand: float | None = None
        self._overturned = self._free = False

    def enter(self, first: tuple[int, int, int], torso: tuple[int, int, int], belly: float, radius: float) -> None:
        """Enter its places in the physics: first position, velocity and control; torso (-1: no legs); sizes, m."""
        row = self._row
        row[HULL_Q], row[HULL_V], row[HULL_A] = first
        row[HULL_TORSO], row[HULL_TORSO_V], row[HULL_TORSO_CONTROL] = torso
        row[HULL_UNDERSIDE], row[HULL_RADIUS], row[HULL_WALLS] = belly, radius, -math.inf

    @property
    def x(self) -> float:
        """Coordinate of base_link in the world, m."""
        return self._row[HULL_X]

    @property
    def y(self) -> float:
        """Coordinate of base_link in the world, m."""
        return self._row[HULL_Y]

    @property
    def elevation(self) -> float:
        """Height of base_link in the world, m."""
        return self._row[HULL_Z]

    @property
    def belly(self) -> float:
        """Height of the torso's underside above the floor, m."""
        return self._row[HULL_UNDERSIDE]

    @property
    def turned(self) -> float:
        """Yaw without wrapping, rad."""
        return self._row[HULL_YAW]

    @property
    def pose(self) -> Pose:
        """Pose of base_link in world (m, rad)."""
        row, posed = self._row, self._posed
        x, y, turned = row[HULL_X], row[HULL_Y], row[HULL_YAW]
        if posed is None or posed[0] != turned or posed[1].x != x or posed[1].y != y:
            self._posed = posed = turned, Pose(x, y, wrap_angle(turned))
        return posed[1]

    @property
    def motion(self) -> Motion:
        """Speed along x, y and z (m/s; z of the torso), and the turn rate (rad/s)."""
        vx, vy, vz, turn = self._row[HULL_VX : HULL_VX + 4]
        return vx, vy, vz, turn

    @property
    def before(self) -> Motion:
        """The same one step earlier."""
        vx, vy, vz, turn = self._row[HULL_LAST_V : HULL_LAST_V + 4]
        return vx, vy, vz, turn

    @property
    def pulls(self) -> bool:
        """True if the wheels drive the robot over the ground."""
        row = self._row
        return not row[HULL_HELD] and bool(row[HULL_DRIVE_X] or row[HULL_DRIVE_X + 1])

    @property
    def gaze(self) -> tuple[float, float]:
        """Pitch and yaw of the gimbal, rad; zero without one."""
        return self._row[HULL_GIMBAL_PITCH], self._row[HULL_GIMBAL_PITCH + 1]

    @gaze.setter
    def gaze(self, gaze: tuple[float, float]) -> None:
        self._row[HULL_GIMBAL_PITCH], self._row[HULL_GIMBAL_PITCH + 1] = gaze

    @property
    def tilt(self) -> tuple[float, float]:
        """Roll and pitch, rad, REP-103."""
        return self._tilt

    @tilt.setter
    def tilt(self, tilt: tuple[float, float]) -> None:
        self._tilt = tilt
        self._note_leaning()

    @property
    def attitude(self) -> Orientation:
        """The torso's attitude on its legs, relative to base_link, rad; truth, without physics."""
        return self._attitude

    @attitude.setter
    def attitude(self, attitude: Orientation) -> None:
        self._attitude = attitude
        self._note_leaning()

    def _note_leaning(self) -> None:
        self._row[HULL_TILTED] = float(self._tilt is not LEVEL or self._attitude != STRAIGHT)

    @property
    def hand(self) -> float | None:
        """Height in the world at which a hand holds base_link, m."""
        return self._hand

    @hand.setter
    def hand(self, height: float | None) -> None:
        self._hand = height
        self._note_held()

    @property
    def overturned(self) -> bool:
        """True if the robot lies on a side or its back."""
        return self._overturned

    @overturned.setter
    def overturned(self, lies: bool) -> None:
        self._overturned = lies
        self._note_held()

    def _note_held(self) -> None:
        self._row[HULL_HELD] = float(self._hand is not None or self._overturned or self._free)

    def drive(self, twist: Twist) -> None:
        """Drive the wheels at ``twist`` (base_link) from now on, if they are on the ground."""
        row = self._row
        row[HULL_DRIVE_X], row[HULL_DRIVE_X + 1], row[HULL_DRIVE_YAW] = twist.x, twist.y, twist.yaw
        row[HULL_LINEAR_STEP] = 0.0

    def approach(self, goal: Twist, linear: float, angular: float) -> None:
        """Let the kernel drive the wheels towards ``goal``, by these steps (m/s, rad/s) a tick, until ``drive``."""
        row = self._row
        row[HULL_GOAL_X], row[HULL_GOAL_X + 1], row[HULL_GOAL_X + 2] = goal.x, goal.y, goal.yaw
        row[HULL_LINEAR_STEP], row[HULL_ANGULAR_STEP] = linear, angular

    @property
    def approaches(self) -> bool:
        """True while the kernel does so."""
        return self._row[HULL_LINEAR_STEP] > 0.0

    @property
    def wheels_velocity(self) -> Twist:
        """Present velocity of the wheels (base_link), as noted."""
        return Twist(*self._row[HULL_WHEEL_X : HULL_WHEEL_X + 3])

    def note_wheels(self, twist: Twist, *, slack: bool) -> None:
        """Note the wheels' present velocity (base_link) for sensors; ``slack``: some are dead, or all roll freely."""
        row = self._row
        row[HULL_WHEEL_X], row[HULL_WHEEL_X + 1], row[HULL_WHEEL_X + 2] = twist.x, twist.y, twist.yaw
        row[HULL_UNDRIVEN] = float(slack)
