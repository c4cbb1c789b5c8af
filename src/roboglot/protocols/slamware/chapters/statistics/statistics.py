"""Chapter "statistics": metres and seconds over the robot's life."""

from __future__ import annotations

from roboglot.model.components.sensing.odometry import Odometry
from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE

API = "/api/core/statistics/v1"


@TABLE.on(f"GET {API}/odometry", right=Right.SEE, needs=(Odometry,))
def get_odometry(context: Context) -> float:
    """Return the metres travelled."""
    return round(context.totals.metres, 3)


@TABLE.on(f"GET {API}/runtime", right=Right.SEE)
def get_runtime(context: Context) -> float:
    """Return the seconds of robot time."""
    return round(context.totals.seconds, 3)
