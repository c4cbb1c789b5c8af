"""Chapter "statistics": metres and seconds over the robot's life."""

from __future__ import annotations

from roboglot.model.components.sensing.odometry import Odometry
from roboglot.operations import Right
from roboglot.protocols.slamware.table import OPERATIONS, Desk

API = "/api/core/statistics/v1"


@OPERATIONS.on(f"GET {API}/odometry", right=Right.SEE, needs=(Odometry,))
async def get_odometry(desk: Desk) -> float:
    """Metres travelled."""
    return round(desk.totals.metres, 3)


@OPERATIONS.on(f"GET {API}/runtime", right=Right.SEE)
async def get_runtime(desk: Desk) -> float:
    """Seconds of robot time."""
    return round(desk.totals.seconds, 3)
