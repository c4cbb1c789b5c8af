"""Dead reckoning: distance from the wheels (scale error, noise, slip), heading from the gyro. Drifts without jumps."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct, structs

from roboglot.kernels.layouts import (
    BATCHED,
    HULL_WIDTH,
    IMU_WIDTH,
    ODOMETRY_NEXT_NOISE,
    ODOMETRY_NOISE,
    ODOMETRY_NOISES,
    ODOMETRY_SCALE_X,
    ODOMETRY_SCALE_Y,
    ODOMETRY_STATE,
    ODOMETRY_STILL,
    ODOMETRY_WIDTH,
    RECKONED,
    SINGLE,
    USE,
)
from roboglot.model.components.sensing.odometry import Odometry, OdometryNoise
from roboglot.model.geometry import Pose, Twist, wrap_angle
from roboglot.model.sensing import OdometryReading
from roboglot.simulation.bodies.hull_state import TABLE as HULLS
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative, Positive
from roboglot.simulation.bodies.tables import BatchedSense, RobotRows, RobotTables, Sense, TickStage
from roboglot.simulation.components.motion.base import SimulatedBase
from roboglot.simulation.components.sensing.imu import TABLE as IMUS
from roboglot.simulation.components.sensing.imu import SimulatedImu

USUAL = OdometryNoise()
DRAWN = 64  # ticks for which noise is drawn at once
NOISE_WIDTH = DRAWN * ODOMETRY_NOISES
TABLE, NOISES = "odometry", "odometry noises"


class DescribedNoise(Struct, frozen=True, forbid_unknown_fields=True):
    """Noise by the manufacturer's description: see ``OdometryNoise``."""

    still: Positive = USUAL.still
    along: NotNegative = USUAL.along
    turning: NotNegative = USUAL.turning
    yaw_still: Positive = USUAL.yaw_still
    yaw_per_rad: NotNegative = USUAL.yaw_per_rad
    yaw_per_metre: NotNegative = USUAL.yaw_per_metre


class OdometrySection(Struct, frozen=True, forbid_unknown_fields=True):
    """``scale_error`` of the wheels, ``noise`` per distance: standard deviations; ``described``: by the manufacturer.

    ``turn_slip``: m/s of sliding ahead per rad/s of turning; an encoder jumps by ``jump`` m every ``jump_every`` s on
    average while driving (0: never).
    """

    scale_error: NotNegative
    noise: NotNegative
    still_rate: NotNegative
    described: DescribedNoise = DescribedNoise()
    turn_slip: NotNegative = 0.0
    jump: NotNegative = 0.0
    jump_every: NotNegative = 0.0


class SimulatedOdometry(Odometry):
    """Odometry that starts at (0, 0, 0) in odom."""

    def __init__(
        self,
        section: OdometrySection,
        base: SimulatedBase,
        imu: SimulatedImu,
        random: np.random.Generator,
        robot_rows: RobotRows,
    ) -> None:
        self._section, self._base, self._imu, self._random = section, base, imu, random
        self._scale_x, self._scale_y = (1.0 + random.normal(0.0, section.scale_error, 2)).tolist()
        self._disturbs = bool(section.turn_slip or section.jump_every)
        self.index = robot_rows.index
        self._row = row = robot_rows.row(TABLE, ODOMETRY_WIDTH)
        self._noises = robot_rows.row(NOISES, NOISE_WIDTH)
        row[USE] = SINGLE if self._disturbs else BATCHED
        row[ODOMETRY_SCALE_X], row[ODOMETRY_SCALE_Y] = self._scale_x, self._scale_y
        row[ODOMETRY_NOISE], row[ODOMETRY_STILL] = section.noise, section.still_rate
        self.forget_noise()
        self._reading: OdometryReading | None = None  # of the stamp in the row, once read

    @property
    def reading(self) -> OdometryReading:
        stamp, x, y, yaw, vx, vy, rate, way = self._row[ODOMETRY_STATE:]
        if self._reading is None or self._reading.stamp != stamp:
            self._reading = OdometryReading(stamp, Pose(x, y, yaw), Twist(vx, vy, rate), way)
        return self._reading

    @property
    def pose(self) -> Pose:
        """Pose of the reading in odom (m, rad), without building the whole reading."""
        x, y, yaw = self._row[ODOMETRY_STATE + 1 : ODOMETRY_STATE + 4]
        return Pose(x, y, yaw)

    def _disturbed(self, x: float, y: float, yaw: float, seconds: float) -> tuple[float, float]:
        """Return the position (odom, m) with the errors of slip and encoder jumps."""
        section, off = self._section, 0.0
        if section.turn_slip:
            off += section.turn_slip * abs(self._imu.rate) * math.copysign(seconds, self._base.velocity.x)
        if section.jump_every and self._random.random() < seconds / section.jump_every:
            off += math.copysign(section.jump, self._random.standard_normal())
        return x + off * math.cos(yaw), y + off * math.sin(yaw)

    @property
    def noise(self) -> OdometryNoise:
        return OdometryNoise(**structs.asdict(self._section.described))

    def forget_noise(self) -> None:
        """Discard the drawn noise: the seed has changed."""
        self._row[ODOMETRY_NEXT_NOISE] = NOISE_WIDTH

    def sense(self, stamp: float, seconds: float) -> None:
        """Add one tick's motion."""
        wheels = self._base.velocity
        _, x, y, yaw, _, _, _, way = self._row[ODOMETRY_STATE:]
        still = not (wheels.x or wheels.y or wheels.yaw)
        # With wheels at rest, a slow rate is the gyro's own error.
        rate, section = self._imu.rate, self._section
        if still and abs(rate) < section.still_rate:
            rate = 0.0
        vx = vy = 0.0
        if wheels.x or wheels.y:
            noise_x, noise_y = self._noise()
            vx = wheels.x * (self._scale_x + section.noise * noise_x)
            vy = wheels.y * (self._scale_y + section.noise * noise_y)
            if self._disturbs:
                x, y = self._disturbed(x, y, yaw, seconds)
            middle = yaw + rate * seconds / 2
            c, s = math.cos(middle), math.sin(middle)
            x += (c * vx - s * vy) * seconds
            y += (s * vx + c * vy) * seconds
            way += math.sqrt(vx * vx + vy * vy) * seconds
        if rate:
            yaw += rate * seconds
            if not -math.pi < yaw <= math.pi:
                yaw = wrap_angle(yaw)
        for column, number in enumerate((stamp, x, y, yaw, vx, vy, rate, way), start=ODOMETRY_STATE):
            self._row[column] = number
        self._reading = None

    def _noise(self) -> list[float]:
        """Return the tick's two numbers."""
        at = int(self._row[ODOMETRY_NEXT_NOISE])
        if at == NOISE_WIDTH:
            self._noises.cast("B")[:] = self._random.standard_normal(NOISE_WIDTH).data.cast("B")
            at = 0
        self._row[ODOMETRY_NEXT_NOISE] = at + ODOMETRY_NOISES
        return list(self._noises[at : at + ODOMETRY_NOISES])


def _sense_all(tables: RobotTables, parts: Sequence[tuple[SimulatedOdometry, Sense]]) -> BatchedSense:
    """Return a function that reckons for all robots, in one call of the kernel."""
    inputs = (
        tables.table(HULLS, HULL_WIDTH),
        tables.table(IMUS, IMU_WIDTH),
        tables.table(TABLE, ODOMETRY_WIDTH),
    )
    noises = tables.table(NOISES, NOISE_WIDTH)
    return tables.sense(
        {odometry.index: sense for odometry, sense in parts},
        lambda kernels, stamp, seconds: kernels.dead_reckon(*inputs, noises, stamp, seconds, tables.others),
        TickStage(RECKONED, (inputs[-1], noises)),
    )


def _fit(fit: Fitting) -> SimulatedOdometry:
    base, imu = fit.get(SimulatedBase), fit.get(SimulatedImu)
    odometry = SimulatedOdometry(fit.body[OdometrySection], base, imu, fit.chance("odometry"), fit.hull.robot_rows)
    fit.world.chances.on_reseed(odometry.forget_noise)
    return odometry


PART = Part(
    name="odometry",
    interface=Odometry,
    section=OdometrySection,
    needs=("imu",),
    fit=_fit,
    after=("base", "imu"),
    sense=SimulatedOdometry.sense,
    sense_all=_sense_all,
)
