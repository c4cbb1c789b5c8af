"""Chapter "platform": the system's time and events."""

from __future__ import annotations

from roboglot.operations import Right
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE
from roboglot.protocols.slamware.vocabulary import milliseconds
from roboglot.wire.slamware.chapters.platform import RobotEvent

API = "/api/platform/v1"


@TABLE.on(f"GET {API}/timestamp", right=Right.SEE)
def get_timestamp(context: Context) -> str:
    """Return milliseconds since the robot started, as text; a hard restart begins anew."""
    return str(milliseconds(context.robot.clock.time(), context.robot.starts.robot))


@TABLE.on(f"GET {API}/events", right=Right.SEE)
def get_events(context: Context) -> list[RobotEvent]:
    """Return the events since the last call."""
    return context.events.read()
