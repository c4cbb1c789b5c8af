"""Motion status: tilt and blows from the IMU, slip from wheels and motion, lifting from contacts."""

from __future__ import annotations

import math

from msgspec import Struct

from roboglot.model.components.motion.motion_status import MotionFlags, MotionStatus
from roboglot.model.geometry import Twist
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Positive
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.sensing.imu import SimulatedImu

STILL_SPEED, STILL_RATE = 0.01, 0.03  # m/s and rad/s
CLIMBING = 0.01  # m/s up or down
SLOPE, ROLLED = math.radians(5), math.radians(60)
SLIP_SPEED, SLIP_RATE = 0.15, 0.4  # m/s and rad/s between wheels and body
SLIP_SQUARE = SLIP_SPEED**2
SLIP_TICKS = 5  # in a row before it counts: contacts jitter


class MotionStatusSection(Struct, frozen=True, forbid_unknown_fields=True):
    """``blow``: acceleration that counts as an impact, m/s2; ``hold``: s for which an impact is reported."""

    blow: Positive
    hold: Positive


class SimulatedMotionStatus(MotionStatus):
    """Status that computes most flags on request, but watches impacts and slip all the time."""

    def __init__(self, section: MotionStatusSection, hull: Hull, base: SimulatedBase, imu: SimulatedImu) -> None:
        self._section, self._hull, self._base, self._imu = section, hull, base, imu
        self._stamp = 0.0
        self._blows = [-math.inf] * 3  # time of the last blow along x, y, z
        self._slipping = 0

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
        impacts = [self._stamp - blow <= self._section.hold for blow in self._blows]
        return MotionFlags(
            static=static,
            uphill=sloping and not static and vz > CLIMBING,
            downhill=sloping and vz < -CLIMBING and driven,
            sliding=sloping and vz < -CLIMBING and not driven,
            picked_up=picked_up,
            slipping=self._slipping >= SLIP_TICKS and not picked_up and not hull.overturned,
            impact_x=impacts[0],
            impact_y=impacts[1],
            impact_z=impacts[2],
            rolled_over=tilt >= ROLLED,
            static_on_slope=sloping and static,
        )

    def sense(self, stamp: float, _seconds: float) -> None:
        """Watch for blows and slip; after the IMU."""
        self._stamp = stamp
        (x, y, z), blow = self._imu.felt, self._section.blow
        if not -blow <= x <= blow:
            self._blows[0] = stamp
        if not -blow <= y <= blow:
            self._blows[1] = stamp
        if abs(abs(z) - GRAVITY) > blow:
            self._blows[2] = stamp
        wheels, hull = self._base.velocity, self._hull
        vx, vy, _, turn = hull.motion
        if wheels.x or wheels.y or wheels.yaw or vx * vx + vy * vy > SLIP_SQUARE:
            self._slipping = self._slipping + 1 if self._slips(wheels, vx, vy, turn) else 0
        elif self._slipping:
            self._slipping = 0

    def _slips(self, wheels: Twist, vx: float, vy: float, turn: float) -> bool:
        """True if the body's motion (m/s, rad/s, world) differs from that of the wheels."""
        if not -SLIP_RATE <= turn - wheels.yaw <= SLIP_RATE:
            return True
        hull = self._hull
        c, s = math.cos(hull.turned), math.sin(hull.turned)
        off_x, off_y = c * vx + s * vy - wheels.x, c * vy - s * vx - wheels.y
        return off_x * off_x + off_y * off_y > SLIP_SQUARE


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
)
