"""Requests that stop the robot: they wait for no other client."""

from __future__ import annotations

from roboglot.wire.cyberdog.chapters.motion.motion import CommandType, Motion
from roboglot.wire.cyberdog.codes import Code
from roboglot.wire.cyberdog.text import NotJson, read_params
from roboglot.wire.visual.requests import stops as frame_stops

STOPS = frozenset({Code.STOP_TASK, Code.END_STAIR_ALIGNMENT, Code.POWER_OFF})


def stops(code: int, params: str) -> bool:
    """Return whether a request is one to stop."""
    if code == Code.PROGRAM_TO_ROBOT:
        return frame_stops(params)
    if code not in (Code.SERVO, Code.MOTION):
        return code in STOPS
    try:
        fields = read_params(params)
    except NotJson:
        return False
    if code == Code.MOTION:
        return fields.get("motion_id") == Motion.EMERGENCY_STOP
    speeds = fields.get("vel_des")
    return fields.get("cmd_type") == CommandType.END or (isinstance(speeds, list) and not any(speeds))
