"""Readings of sensors. SI units, base_link unless said otherwise."""

from __future__ import annotations

from enum import StrEnum
from typing import TYPE_CHECKING

from roboglot.extras import lazy
from roboglot.model.geometry import ORIGIN, Orientation, Pose, Twist, Vector3
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
else:
    np = lazy("numpy")


@dataclass(frozen=True, slots=True)
class LaserScan:
    """One turn of a planar lidar.

    ``ranges[i]`` (m, float32) lies at ``angle_min + i * angle_increment`` (rad, counter-clockwise, 0 straight ahead in
    the lidar's frame). inf: there was nothing within range; NaN: nothing is known of this direction (too near, too dark
    or too bright to be measured, lost on the way, masked). ``mount`` is the lidar's pose in base_link.

    Ray i was taken ``time_increment`` s after ray i - 1, ray 0 at ``stamp``; 0: all at once. Of a ray without an echo
    the first ``clear_range`` m are taken to be free: what is dark or made of glass may stand there unseen.
    """

    stamp: float
    ranges: NDArray[np.float32]
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    mount: Pose = ORIGIN
    time_increment: float = 0.0
    clear_range: float = 4.0

    @property
    def angles(self) -> NDArray[np.float64]:
        """The direction of each range, rad, in the lidar's frame."""
        return self.angle_min + self.angle_increment * np.arange(len(self.ranges), dtype=np.float64)


@dataclass(frozen=True, slots=True)
class ImuReading:
    """Attitude (rad), angular velocity (rad/s) and linear acceleration incl. gravity (m/s2)."""

    stamp: float
    orientation: Orientation
    angular_velocity: Vector3
    linear_acceleration: Vector3


@dataclass(frozen=True, slots=True)
class RawImu:
    """Raw counts of gyro, accelerometer and compass: x, y, z along base_link's axes.

    Counts times their ``unit`` are m/s2 (gravity included), rad/s and tesla.
    """

    stamp: float
    acceleration: tuple[int, int, int]
    rate: tuple[int, int, int]
    field: tuple[int, int, int]
    acceleration_unit: float
    rate_unit: float
    field_unit: float


@dataclass(frozen=True, slots=True)
class OdometryReading:
    """Pose of base_link by the wheels (odom frame, drifts, never jumps) and its velocity."""

    stamp: float
    pose: Pose
    twist: Twist
    distance: float  # m travelled since start, without turns in place


class Supply(StrEnum):
    """Source of power besides the battery."""

    NONE = "none"
    CONTACTS = "contacts"  # of a dock
    WIRELESS = "wireless"  # a dock's coil
    WIRE = "wire"


@dataclass(frozen=True, slots=True)
class BatteryState:
    """Charge 0..1, voltage V, current A (negative = discharging), temperature Celsius, cycles so far.

    ``capacity``: what it holds when full now, Ah; ``health``: that as a share (0..1) of what it held when new;
    ``remaining``: s until it is empty if the robot goes on as in the last minute, ``None`` while something feeds it;
    ``charge_locked``: its guard lets nothing in (too warm); ``buzzing``: it beeps because it is almost empty.
    """

    percentage: float
    voltage: float
    current: float
    temperature: float
    charging: bool
    cycles: int
    supply: Supply = Supply.NONE
    capacity: float = 0.0
    health: float = 1.0
    remaining: float | None = None
    charge_locked: bool = False
    buzzing: bool = False

    @property
    def wired_charging(self) -> bool:
        """Charging by a cable: what the protocols call wired, whatever a dock charges through."""
        return self.charging and self.supply is Supply.WIRE

    @property
    def dock_charging(self) -> bool:
        """Charging on a dock."""
        return self.charging and self.supply in (Supply.CONTACTS, Supply.WIRELESS)
