"""Gyro and accelerometer with scale error, bias and noise; yaw is the gyro's integral and drifts.

The accelerometer gives the mean over a tick, like a filtered one: contacts make momentary values useless.
Roll and pitch are exact: a real filter's error in them would be negligible.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from roboglot.model.components.sensing.imu import Imu
from roboglot.model.geometry import LEVEL as STRAIGHT
from roboglot.model.geometry import Orientation, Vector3, wrap_angle
from roboglot.model.sensing import ImuReading, RawImu
from roboglot.simulation.bodies.hull import LEVEL, Hull, rotation
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import NotNegative
from roboglot.simulation.bodies.support import GRAVITY

ACCELERATION_UNIT = GRAVITY / 8192  # per unit of a 16-bit converter for 4 g
RATE_UNIT = math.radians(1.0 / 65.5)  # for 500 degrees/s
FIELD_UNIT = 0.15e-6  # T
FIELD_NOISE = 0.4e-6  # T, one standard deviation
COUNTS_MAX = 32767
HORIZONTAL, DOWN = 22e-6, 43e-6  # T: the earth's field at middle latitudes
SIX = struct.Struct("6d")
DRAWN = 64  # ticks for which noise is drawn at once


class ImuSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Standard deviations of noise, constant bias and scale error of gyro (rad/s) and accelerometer (m/s2)."""

    gyro_noise: NotNegative
    gyro_bias: NotNegative
    gyro_scale: NotNegative
    acceleration_noise: NotNegative
    acceleration_bias: NotNegative


class SimulatedImu(Imu):
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
        self.forget()
        self._yaw = 0.0
        self.rate = 0.0  # rad/s: the gyro's mean turn rate over the last tick
        self.felt = (0.0, 0.0, GRAVITY)  # the accelerometer's x, y, z, m/s2
        self._level = (0.0, 0.0, 0.0, 0.0)  # stamp and rates (rad/s) of a reading that has not been read yet
        self._reading: ImuReading | None = None
        self._raw: RawImu | None = None
        self._compass, self._field = compass, field  # random numbers, and the earth's field in the world's frame, T
        self._noises, self._at = b"", 0  # six numbers per tick, and where the next ones begin

    @property
    def reading(self) -> ImuReading:
        if self._reading is None:
            stamp, *rates = self._level
            self._reading = ImuReading(stamp, Orientation(yaw=self._yaw), Vector3(*rates), Vector3(*self.felt))
        return self._reading

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
        self._turned, self._motion = self._hull.turned, self._hull.motion

    def forget_noise(self) -> None:
        """Discard the drawn noise: the seed has changed."""
        self._noises, self._at = b"", 0

    def sense(self, stamp: float, seconds: float) -> None:
        """Measure one tick."""
        hull, scale = self._hull, self._scale
        if self._at == len(self._noises):
            drawn = self._random.standard_normal((DRAWN, 6)) * self._sigma + self._bias
            self._noises, self._at = drawn.tobytes(), 0
        noise = SIX.unpack_from(self._noises, self._at)  # lists of floats would crowd the caches of a hundred robots
        self._at += SIX.size
        turned, motion = hull.turned, hull.motion
        self.rate = rate = (turned - self._turned) / seconds * scale + noise[2]
        yaw = self._yaw + rate * seconds
        self._yaw = yaw if -math.pi < yaw <= math.pi else wrap_angle(yaw)
        (ux, uy, uz, _), (vx, vy, vz, turning) = self._motion, motion
        self._turned, self._motion = turned, motion
        ax, ay, az = (vx - ux) / seconds, (vy - uy) / seconds, (vz - uz) / seconds
        attitude = hull.attitude
        straight = (attitude is STRAIGHT and self._held is STRAIGHT) or attitude == self._held == STRAIGHT
        if hull.tilt is not LEVEL or not straight:
            self._reading = reading = self._tilted(stamp, (ax, ay, az + GRAVITY), noise, seconds)
            felt = reading.linear_acceleration
            self.felt = felt.x, felt.y, felt.z
            return
        c, s = math.cos(turned), math.sin(turned)
        self.felt = c * ax + s * ay + noise[3], c * ay - s * ax + noise[4], az + GRAVITY + noise[5]
        self._level = stamp, noise[0], noise[1], turning * scale + noise[2]
        self._reading = None

    def _tilted(
        self, stamp: float, felt: tuple[float, float, float], noise: Sequence[float], seconds: float
    ) -> ImuReading:
        """Measure with a tilted body, by ground or legs; ``felt``: acceleration plus gravity, world, m/s2."""
        hull, held, before = self._hull, self._hull.attitude, self._held
        self._held = held
        roll, pitch = hull.tilt[0] + held.roll, hull.tilt[1] + held.pitch
        rolling = hull.tilting[0] + wrap_angle(held.roll - before.roll) / seconds
        pitching = hull.tilting[1] + wrap_angle(held.pitch - before.pitch) / seconds
        turning = hull.motion[3] + wrap_angle(held.yaw - before.yaw) / seconds
        x, y, z = (np.array(felt) @ rotation((roll, pitch), hull.turned + held.yaw)).tolist()
        cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
        rates = rolling - turning * sp, pitching * cr + turning * cp * sr, turning * cp * cr - pitching * sr
        return ImuReading(
            stamp,
            Orientation(wrap_angle(roll), wrap_angle(pitch), wrap_angle(self._yaw + held.yaw)),
            Vector3(*(rate * self._scale + error for rate, error in zip(rates, noise[:3], strict=True))),
            Vector3(x + noise[3], y + noise[4], z + noise[5]),
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
    return imu


PART = Part(
    name="imu",
    interface=Imu,
    section=ImuSection,
    fit=_fit,
    sense=SimulatedImu.sense,
    displaced=SimulatedImu.forget,
)
