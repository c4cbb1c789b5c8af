"""Chapter "system": parameters, effective at once and lost at a restart."""

from __future__ import annotations

import re

from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.emergency_stop import EmergencyStop, is_stopped
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.robot import Robot
from roboglot.operations import Right
from roboglot.protocols.slamware.chapters.system.health import LIMP
from roboglot.protocols.slamware.context import Context
from roboglot.protocols.slamware.table import TABLE, Text
from roboglot.wire.slamware.chapters.system.devices import Parameter, Readable

PARAMETER = "/api/core/system/v1/parameter"
SWITCH = {"on": True, "off": False}
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


@TABLE.on(f"GET {PARAMETER}", right=Right.SEE, needs=(Base,), some=(Docking,))
def get_system_parameter(context: Context, param: Readable) -> Text:
    """Return a top speed (m/s, rad/s), as text with six decimals, or when touched docks are registered."""
    match param:
        case "base.max_moving_speed":
            return Text(f"{context.robot[Base].limits.twist.x:.6f}")
        case "base.max_angular_speed":
            return Text(f"{context.robot[Base].limits.twist.yaw:.6f}")
        case "docking.docked_register_strategy":
            context.robot.require(Docking)
            return Text("when_not_exists")  # the actual behaviour: only a robot without a dock learns one by touch


@TABLE.on(f"PUT {PARAMETER}", right=Right.DRIVE, needs=(Base,), some=(EmergencyStop,))
def set_system_parameter(context: Context, body: Parameter) -> bool:
    """Set a speed limit, the emergency stop or the brake release."""
    match body.param:
        case "base.max_moving_speed":
            context.limits.set(speed=_number(body.value))
        case "base.max_angular_speed":
            context.limits.set(turning=_number(body.value))
        case "base.emergency_stop" if _switch(body.value):
            context.robot[EmergencyStop].engage()
        case "base.emergency_stop":
            _release(context.robot)
        case "base.brake_release":
            context.robot[EmergencyStop].release_brake(_switch(body.value))
    return True


def _release(robot: Robot) -> None:
    """End the emergency stop. Raises Refused if only limp legs hold the robot, which standing up ends."""
    stop = robot[EmergencyStop]
    if is_stopped(robot) and not stop.engaged:
        raise Refused(LIMP)
    stop.release()


def _number(value: str | float) -> float:
    if isinstance(value, str) and not NUMBER.fullmatch(value):
        raise InvalidGoal(f"'{value}' is not a number")
    return float(value)


def _switch(value: str | float) -> bool:
    if value not in SWITCH:
        raise InvalidGoal("the value must be on or off")
    return SWITCH[str(value)]
