"""Chapter "statistics": metres and seconds."""

from __future__ import annotations

from roboglot.model.components.odometry import Odometry
from roboglot.protocols.slamware.operations import OPERATIONS, Desk

API = "/api/core/statistics/v1"
SINCE_START = "counts from this start on, not over the robot's life"


@OPERATIONS.on(f"GET {API}/odometry", partial=SINCE_START)
async def get_odometry(desk: Desk) -> float:
    """Metres travelled."""
    return round(desk.robot[Odometry].reading.distance, 3)


@OPERATIONS.on(f"GET {API}/runtime", partial=SINCE_START)
async def get_runtime(desk: Desk) -> float:
    """Seconds of robot time."""
    return round(desk.robot.clock.time(), 3)
