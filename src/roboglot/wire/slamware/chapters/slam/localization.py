"""Chapter "slam": switches, the IMU. Maps have files of their own."""

from __future__ import annotations

import msgspec

from roboglot.wire.slamware.chapters.artifact import Metadata
from roboglot.wire.slamware.geometry import Location, Point, Quaternion


class Switch(msgspec.Struct):
    """The body of every ``:enable``."""

    enable: bool


IMU_RAW = 16 | 32 | 64  # raw accelerometer, gyro and compass
IMU_QUATERNION, IMU_ACCELEROMETER, IMU_GYROSCOPE, IMU_EULER = 1, 2, 4, 512  # bits of ImuData.availability


class ImuData(msgspec.Struct):
    """Attitude, acceleration and turning rates in the robot's frame; ``availability`` flags the valid ones.

    The vendor spells the bit map "availibilityBitMap"; one edition of the manual does not. Both are sent.
    """

    acc: Location
    gyro: Location
    euler_angle: Location
    quaternion: Quaternion
    compass: Location
    raw_acc: Location
    raw_gyro: Location
    raw_compass: Location
    timestamp: int
    vendor_availability: int = msgspec.field(name="availibilityBitMap")
    availability: int = msgspec.field(name="availabilityBitMap")


class Registration(msgspec.Struct):
    """The name of a new dock."""

    metadata: Metadata = None


class NewOrigin(msgspec.Struct):
    """A place of the map."""

    new_origin: Point
