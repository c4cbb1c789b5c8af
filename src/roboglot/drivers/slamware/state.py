"""Latest values that a Slamware robot reported, in the model's units. Written by telemetry, read by components."""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING

from roboglot.extras import is_there, lazy
from roboglot.model.geometry import ORIGIN, STILL, Point, Pose, Twist
from roboglot.model.maps import OccupancyGrid
from roboglot.model.sensing import BatteryState, ImuReading, LaserScan, OdometryReading
from roboglot.values import dataclass

if TYPE_CHECKING:
    import numpy as np
else:
    np = lazy("numpy")


def _nothing() -> OccupancyGrid:
    return OccupancyGrid(np.zeros((0, 0), np.int8), 0.05, Point())


@dataclass(slots=True)
class ReportedState:
    """Starts at the origin with an empty battery and no map until the first reports."""

    pose: Pose = ORIGIN
    quality: float = 0.0
    odometry: OdometryReading = field(default_factory=lambda: OdometryReading(0.0, ORIGIN, STILL, 0.0))
    twist: Twist = STILL
    battery: BatteryState = field(default_factory=lambda: BatteryState(0.0, 0.0, 0.0, 0.0, False, 0))
    docked: bool = False
    scan: LaserScan | None = None
    imu: ImuReading | None = None
    localizing: bool = True
    mapping: bool = True
    closes_loops: bool = True
    grid: OccupancyGrid = field(init=False)  # missing without numpy, as no map is read then
    revision: int = 0
    home: Pose | None = None
    latency: float = 0.0  # s: round trip, smoothed
    action: int | None = None  # the id of the current action

    def __post_init__(self) -> None:
        if is_there("numpy"):
            self.grid = _nothing()
