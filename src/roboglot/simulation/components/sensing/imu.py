"""Gyro and accelerometer with scale error, bias and noise; yaw is the gyro's integral and drifts.

The accelerometer gives the mean over a tick, like a filtered one: contacts make momentary values useless.
Roll and pitch are exact: a real filter's error in them would be negligible.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from roboglot.kernels.layouts import (
    BATCHED,
    HULL_WIDTH,
    IMU_AX,
    IMU_AY,
    IMU_AZ,
    IMU_HULL_VX,
    IMU_HULL_VY,
    IMU_HULL_VZ,
    IMU_HULL_YAW,
    IMU_NEXT_NOISE,
    IMU_NOISES,
    IMU_RATE,
    IMU_RATES,
    IMU_SCALE,
    IMU_STAMP,
    IMU_TILTED,
    IMU_WIDTH,
    IMU_YAW,
    MEASURED,
    USE,
)
from roboglot.model.components.sensing.imu import Imu, ImuConverters
from roboglot.model.geometry import LEVEL as STRAIGHT
from roboglot.model.geometry import Orientation, Vector3, wrap_angle
from roboglot.model.sensing import ImuReading, RawImu
from roboglot.simulation.bodies.hull import Hull, rotation
from roboglot.simulation.bodies.hull_state import LEVEL
from roboglot.simulation.bodies.hull_state import TABLE as HULLS
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.bodies.support import GRAVITY
from roboglot.simulation.bodies.tables import BatchedSense, RobotTables, Sense, TickStage

ACCELERATION_UNIT = GRAVITY / 8192  # per unit of a 16-bit converter for 4 g
RATE_UNIT = math.radians(1.0 / 65.5)  # for 500 degrees/s
FIELD_UNIT = 0.15e-6  # T
FIELD_NOISE = 0.4e-6  # T, one standard deviation
COUNTS_MAX = 32767
HORIZONTAL, DOWN = 22e-6, 43e-6  # T: the earth's field at middle latitudes
TABLE, NOISES = "imu", "imu noises"
DRAWN = 64  # ticks for which noise is drawn at once
NOISE_WIDTH = DRAWN * IMU_NOISES


class ImuSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of noise, constant bias and scale error of gyro (rad/s) and accelerometer (m/s2)."""

    gyro_noise: NotNegative
    gyro_bias: NotNegative
    gyro_scale: NotNegative
    acceleration_noise: NotNegative
    acceleration_bias: NotNegative


class SimulatedImu(Imu, ImuConverters):
    """IMU in the torso, above base_link."""

    averages = True

    def __init__(
        self,
        section: ImuSection,
        hull: Hull,
        random: np.random.Generator,
        compass: np.random.Generator,
        field: tuple[float, float, float],
    ) -> None:
        self._section, self._hull, self._random = section, hull, random
        self._scale = 1.0 + float(random.normal(0.0, section.gyro_scale))
        self._bias = np.concatenate(
            (random.normal(0.0, section.gyro_bias, 3), random.normal(0.0, section.acceleration_bias, 3))
        )
        self._sigma = np.array([section.gyro_noise] * 3 + [section.acceleration_noise] * 3)
        self._held = STRAIGHT  # the legs' last share of the attitude
        self._row = row = hull.robot_rows.row(TABLE, IMU_WIDTH)
        row[USE], row[IMU_SCALE], row[IMU_AZ] = BATCHED, self._scale, GRAVITY
        self.forget()
        self._reading: ImuReading | None = None  # of the stamp in the row, once read
        self._raw: RawImu | None = None
        self._compass, self._field = compass, field  # random numbers, and the earth's field in the world's frame, T
        self._noises = hull.robot_rows.row(NOISES, NOISE_WIDTH)
        self.forget_noise()

    @property
    def reading(self) -> ImuReading:
        stamp, *rates = self._row[IMU_STAMP : IMU_RATES + 3]
        if self._reading is None or self._reading.stamp != stamp:
            self._reading = ImuReading(stamp, Orientation(yaw=self._row[IMU_YAW]), Vector3(*rates), Vector3(*self.felt))
        return self._reading

    @property
    def rate(self) -> float:
        """The gyro's mean turn rate over the last tick, rad/s."""
        return self._row[IMU_RATE]

    @property
    def felt(self) -> tuple[float, float, float]:
        """The accelerometer's x, y, z, m/s2."""
        x, y, z = self._row[IMU_AX : IMU_AZ + 1]
        return x, y, z

    @property
    def index(self) -> int:
        """Row of this part in the table of all robots."""
        return self._hull.robot_rows.index

    @property
    def raw(self) -> RawImu:
        reading, hull = self.reading, self._hull
        if self._raw is None or self._raw.stamp != reading.stamp:
            held = hull.attitude
            across = rotation((hull.tilt[0] + held.roll, hull.tilt[1] + held.pitch), hull.turned + held.yaw)
            field = np.array(self._field) @ across + self._compass.standard_normal(3) * FIELD_NOISE
            self._raw = RawImu(
                reading.stamp,
                _counts(reading.linear_acceleration, ACCELERATION_UNIT),
                _counts(reading.angular_velocity, RATE_UNIT),
                _counts(Vector3(*field.tolist()), FIELD_UNIT),
                ACCELERATION_UNIT,
                RATE_UNIT,
                FIELD_UNIT,
            )
        return self._raw

    def forget(self) -> None:
        """Forget the last motion: the robot was put elsewhere, without a measurement in between."""
        row = self._row
        row[IMU_HULL_YAW] = self._hull.turned
        row[IMU_HULL_VX], row[IMU_HULL_VY], row[IMU_HULL_VZ], _ = self._hull.motion

    def forget_noise(self) -> None:
        """Discard the drawn noise: the seed has changed."""
        self._row[IMU_NEXT_NOISE] = len(self._noises)

    def sense(self, stamp: float, seconds: float) -> None:
        """Measure one tick."""
        hull, scale, row = self._hull, self._scale, self._row
        at = int(row[IMU_NEXT_NOISE])
        if at == len(self._noises):
            drawn = self._random.standard_normal((DRAWN, IMU_NOISES)) * self._sigma + self._bias
            self._noises.cast("B")[:] = drawn.data.cast("B")
            at = 0
        noise = list(self._noises[at : at + IMU_NOISES])
        row[IMU_NEXT_NOISE] = at + IMU_NOISES
        turned, motion = hull.turned, hull.motion
        row[IMU_RATE] = rate = (turned - row[IMU_HULL_YAW]) / seconds * scale + noise[2]
        row[IMU_YAW] = wrap_angle(row[IMU_YAW] + rate * seconds)
        ux, uy, uz = row[IMU_HULL_VX : IMU_HULL_VZ + 1]
        vx, vy, vz, turning = motion
        row[IMU_HULL_YAW] = turned
        row[IMU_HULL_VX], row[IMU_HULL_VY], row[IMU_HULL_VZ] = vx, vy, vz
        ax, ay, az = (vx - ux) / seconds, (vy - uy) / seconds, (vz - uz) / seconds
        row[IMU_STAMP] = stamp
        if hull.tilt is not LEVEL or hull.attitude != STRAIGHT or self._held != STRAIGHT:
            self._reading = reading = self._tilted(stamp, (ax, ay, az + GRAVITY), noise, seconds)
            felt = reading.linear_acceleration
            row[IMU_AX], row[IMU_AY], row[IMU_AZ] = felt.x, felt.y, felt.z
            return
        c, s = math.cos(turned), math.sin(turned)
        row[IMU_AX], row[IMU_AY] = c * ax + s * ay + noise[3], c * ay - s * ax + noise[4]
        row[IMU_AZ] = az + GRAVITY + noise[5]
        row[IMU_RATES], row[IMU_RATES + 1], row[IMU_RATES + 2] = noise[0], noise[1], turning * scale + noise[2]
        self._reading = None

    def _tilted(
        self, stamp: float, felt: tuple[float, float, float], noise: Sequence[float], seconds: float
    ) -> ImuReading:
        """Measure with a tilted body, by ground or legs; ``felt``: acceleration plus gravity, world, m/s2."""
        hull, held, before = self._hull, self._hull.attitude, self._held
        self._held = held
        self._row[IMU_TILTED] = float(held != STRAIGHT)
        roll, pitch = hull.tilt[0] + held.roll, hull.tilt[1] + held.pitch
        rolling = hull.tilting[0] + wrap_angle(held.roll - before.roll) / seconds
        pitching = hull.tilting[1] + wrap_angle(held.pitch - before.pitch) / seconds
        turning = hull.motion[3] + wrap_angle(held.yaw - before.yaw) / seconds
        x, y, z = (np.array(felt) @ rotation((roll, pitch), hull.turned + held.yaw)).tolist()
        cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        rates = rolling - turning * sp, pitching * cr + turning * cp * sr, turning * cp * cr - pitching * sr
        return ImuReading(
            stamp,
            Orientation(wrap_angle(roll), wrap_angle(pitch), wrap_angle(self._row[IMU_YAW] + held.yaw)),
            Vector3(*(rate * self._scale + error for rate, error in zip(rates, noise[:3], strict=True))),
            Vector3(x + noise[3], y + noise[4], z + noise[5]),
        )


def _sense_all(tables: RobotTables, parts: Sequence[tuple[SimulatedImu, Sense]]) -> BatchedSense:
    """Return a function that measures with all IMUs, in one call of the kernel as far as they are level."""
    hulls, imus, noises = (
        tables.table(HULLS, HULL_WIDTH),
        tables.table(TABLE, IMU_WIDTH),
        tables.table(NOISES, NOISE_WIDTH),
    )
    return tables.sense(
        {imu.index: sense for imu, sense in parts},
        lambda kernels, stamp, seconds: kernels.measure_imus(
            hulls, imus, noises, stamp, seconds, GRAVITY, tables.others
        ),
        TickStage(MEASURED, (imus, noises), (GRAVITY,)),
    )


def earth_field(north: float) -> tuple[float, float, float]:
    """Return the earth's field in the world frame, T, for the direction of north (rad); no declination."""
    return HORIZONTAL * math.cos(north), HORIZONTAL * math.sin(north), -DOWN


def _counts(vector: Vector3, unit: float) -> tuple[int, int, int]:
    x, y, z = (max(-COUNTS_MAX - 1, min(COUNTS_MAX, round(part / unit))) for part in (vector.x, vector.y, vector.z))
    return x, y, z


def _fit(fit: Fitting) -> SimulatedImu:
    field = earth_field(fit.world.north)
    imu = SimulatedImu(fit.body[ImuSection], fit.hull, fit.chance("imu"), fit.chance("compass"), field)
    fit.world.chances.on_reseed(imu.forget_noise)
    fit.robot.add(ImuConverters, imu)
    return imu


PART = Part(
    name="imu",
    interface=Imu,
    section=ImuSection,
    fit=_fit,
    sense=SimulatedImu.sense,
    sense_all=_sense_all,
    displaced=SimulatedImu.forget,
)
