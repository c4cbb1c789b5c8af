"""Gyro and accelerometer with scale error, bias and noise; yaw is the gyro's integral and drifts.

The accelerometer gives the mean over a tick, as one behind a filter does: contacts make the momentary value useless.
Roll and pitch are true: the filter that levels them leaves less error than anybody can see.
"""

from __future__ import annotations

import math

import numpy as np

from roboglot.model.components.imu import Imu
from roboglot.model.geometry import LEVEL as STRAIGHT
from roboglot.model.geometry import Orientation, Vector3, wrap_angle
from roboglot.model.sensing import ImuReading
from roboglot.simulation.body import Imu as ImuSection
from roboglot.simulation.hull import GRAVITY, LEVEL, Hull, rotation


class SimulatedImu(Imu):
    """Sits in the torso, above base_link."""

    def __init__(self, section: ImuSection, hull: Hull, random: np.random.Generator) -> None:
        self._section, self._hull, self._random = section, hull, random
        self._scale = 1.0 + float(random.normal(0.0, section.gyro_scale))
        self._bias = np.concatenate(
            (random.normal(0.0, section.gyro_bias, 3), random.normal(0.0, section.acceleration_bias, 3))
        )
        self._sigma = np.array([section.gyro_noise] * 3 + [section.acceleration_noise] * 3)
        self._held = STRAIGHT  # the legs' share of the attitude, the last time
        self.forget()
        self._yaw = 0.0
        self.rate = 0.0  # rad/s, the mean turn rate over the last tick as the gyro has it
        self._reading = ImuReading(0.0, Orientation(), Vector3(), Vector3(z=GRAVITY))

    @property
    def reading(self) -> ImuReading:
        return self._reading

    def forget(self) -> None:
        """The robot was lifted and put elsewhere: nothing was felt in between."""
        self._turned, self._motion = self._hull.turned, self._hull.motion

    def sense(self, stamp: float, seconds: float) -> None:
        """Measure one tick."""
        hull = self._hull
        noise = (self._random.standard_normal(6) * self._sigma + self._bias).tolist()
        turned, motion = hull.turned, hull.motion
        self.rate = (turned - self._turned) / seconds * self._scale + noise[2]
        self._yaw = wrap_angle(self._yaw + self.rate * seconds)
        ax, ay, az = ((new - old) / seconds for new, old in zip(motion[:3], self._motion[:3], strict=True))
        self._turned, self._motion = turned, motion
        if hull.tilt is not LEVEL or hull.attitude != STRAIGHT or self._held != STRAIGHT:
            self._reading = self._tilted(stamp, (ax, ay, az + GRAVITY), noise, seconds)
            return
        c, s = math.cos(turned), math.sin(turned)
        self._reading = ImuReading(
            stamp,
            Orientation(yaw=self._yaw),
            Vector3(noise[0], noise[1], motion[3] * self._scale + noise[2]),
            Vector3(c * ax + s * ay + noise[3], c * ay - s * ax + noise[4], az + GRAVITY + noise[5]),
        )

    def _tilted(self, stamp: float, felt: tuple[float, float, float], noise: list[float], seconds: float) -> ImuReading:
        """Measure with a body that leans, by the ground or by its legs; ``felt``: acceleration plus gravity, world."""
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
