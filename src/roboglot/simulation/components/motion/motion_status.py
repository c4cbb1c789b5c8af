"""Motion status: tilt and blows from the IMU, slip from wheels and motion, lifting from contacts."""

from __future__ import annotations

import math
from collections.abc import Sequence

from msgspec import Struct

from roboglot.kernels.layouts import (
    BATCHED,
    HULL_WIDTH,
    IMU_WIDTH,
    STATUS_IMPACT_MIN,
    STATUS_IMPACTS,
    STATUS_SLIPPING,
    STATUS_STAMP,
    STATUS_WIDTH,
    USE,
    WATCHED,
)
from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus
from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.hull_state import TABLE as HULLS
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.bodies.tables import BatchedSense, RobotTables, Sense, TickStage
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.sensing.imu import TABLE as IMUS
from roboglot.simulation.components.sensing.imu import SimulatedImu

STILL_SPEED, STILL_RATE = 0.01, 0.03  # m/s and rad/s
CLIMBING = 0.01  # m/s up or down
SLOPE, ROLLED = math.radians(5), math.radians(60)
SLIP_SPEED, SLIP_RATE = 0.15, 0.4  # m/s and rad/s between wheels and body
SLIP_SQUARE = SLIP_SPEED**2
TABLE = "motion status"
SLIP_TICKS = 5  # in a row before it counts: contacts jitter


class MotionStatusSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``blow``: acceleration that counts as an impact, m/s2; ``hold``: s for which an impact is reported."""

    blow: Positive
    hold: Positive


class SimulatedMotionStatus(MotionStatus):
    """Status that computes most flags on request, but watches impacts and slip all the time."""

    def __init__(self, section: MotionStatusSection, hull: Hull, base: SimulatedBase, imu: SimulatedImu) -> None:
        self._section, self._hull, self._base, self._imu = section, hull, base, imu
        self._row = row = hull.robot_rows.row(TABLE, STATUS_WIDTH)
        row[USE], row[STATUS_IMPACT_MIN] = BATCHED, section.blow
        row[STATUS_IMPACTS] = row[STATUS_IMPACTS + 1] = row[STATUS_IMPACTS + 2] = -math.inf  # of the last along x, y, z

    @property
    def index(self) -> int:
        """Row of this part in the table of all robots."""
        return self._hull.robot_rows.index

    @property
    def flags(self) -> MotionFlags:
        hull, attitude = self._hull, self._imu.reading.orientation
        vx, vy, vz, turn = hull.motion
        tilt = math.acos(max(-1.0, min(1.0, math.cos(attitude.roll) * math.cos(attitude.pitch))))
        static = math.hypot(vx, vy, vz) < STILL_SPEED and abs(turn) < STILL_RATE
        picked_up = not hull.standing and not hull.overturned
        sloping = SLOPE < tilt < ROLLED and not picked_up
        wheels, (c, s) = self._base.velocity, (math.cos(hull.turned), math.sin(hull.turned))
        driven = wheels.x * (c * vx + s * vy) + wheels.y * (c * vy - s * vx) > 0.0  # the motion of the wheels
        row = self._row
        impacts = [row[STATUS_STAMP] - row[STATUS_IMPACTS + axis] <= self._section.hold for axis in range(3)]
        return MotionFlags(
            static=static,
            uphill=sloping and not static and vz > CLIMBING,
            downhill=sloping and vz < -CLIMBING and driven,
            sliding=sloping and vz < -CLIMBING and not driven,
            picked_up=picked_up,
            slipping=row[STATUS_SLIPPING] >= SLIP_TICKS and not picked_up and not hull.overturned,
            impact_x=impacts[0],
            impact_y=impacts[1],
            impact_z=impacts[2],
            rolled_over=tilt >= ROLLED,
            static_on_slope=sloping and static,
        )

    def sense(self, stamp: float, _seconds: float) -> None:
        """Watch for blows and slip; after the IMU."""
        row = self._row
        row[STATUS_STAMP] = stamp
        (x, y, z), blow = self._imu.felt, self._section.blow
        if not -blow <= x <= blow:
            row[STATUS_IMPACTS] = stamp
        if not -blow <= y <= blow:
            row[STATUS_IMPACTS + 1] = stamp
        if abs(abs(z) - GRAVITY) > blow:
            row[STATUS_IMPACTS + 2] = stamp
        wheels, hull = self._base.velocity, self._hull
        vx, vy, _, turn = hull.motion
        if wheels.x or wheels.y or wheels.yaw or vx * vx + vy * vy > SLIP_SQUARE:
            row[STATUS_SLIPPING] = row[STATUS_SLIPPING] + 1 if self._slips(wheels, vx, vy, turn) else 0.0
        else:
            row[STATUS_SLIPPING] = 0.0

    def _slips(self, wheels: Twist, vx: float, vy: float, turn: float) -> bool:
        """True if the body's motion (m/s, rad/s, world) differs from that of the wheels."""
        if not -SLIP_RATE <= turn - wheels.yaw <= SLIP_RATE:
            return True
        hull = self._hull
        c, s = math.cos(hull.turned), math.sin(hull.turned)
        off_x, off_y = c * vx + s * vy - wheels.x, c * vy - s * vx - wheels.y
        return off_x * off_x + off_y * off_y > SLIP_SQUARE


def _sense_all(tables: RobotTables, parts: Sequence[tuple[SimulatedMotionStatus, Sense]]) -> BatchedSense:
    """Return a function that watches for all robots, in one call of the kernel as far as their wheels are whole."""
    inputs = (
        tables.table(HULLS, HULL_WIDTH),
        tables.table(IMUS, IMU_WIDTH),
        tables.table(TABLE, STATUS_WIDTH),
    )
    return tables.sense(
        {status.index: sense for status, sense in parts},
        lambda kernels, stamp, _: kernels.watch_motion(*inputs, stamp, GRAVITY, SLIP_SQUARE, SLIP_RATE, tables.others),
        TickStage(WATCHED, inputs[-1:], (GRAVITY, SLIP_SQUARE, SLIP_RATE)),
    )


def _fit(fit: Fitting) -> SimulatedMotionStatus:
    return SimulatedMotionStatus(fit.body[MotionStatusSection], fit.hull, fit.get(SimulatedBase), fit.get(SimulatedImu))


PART = Part(
    name="motion_status",
    interface=MotionStatus,
    section=MotionStatusSection,
    needs=("imu",),
    fit=_fit,
    after=("base", "imu"),
    sense=SimulatedMotionStatus.sense,
    sense_all=_sense_all,
)
