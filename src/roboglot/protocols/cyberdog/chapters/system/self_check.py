"""The self check of heartbeat and 10001: failed parts of the robot, in the words of ``SelfCheckStatus``.

Warnings (a battery at 10 %, a step ahead) are not failures: the charge and the sensors show them.
"""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.model.components.component import Component
from roboglot.model.components.energy.battery import Battery
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.system.health import FaultLevel, Health
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import SelfCheck

Errors = dict[str, int | dict[str, int]]

NOT_YET, GOOD, BROKEN = -1, 0, 1
LIDAR_ERROR, BATTERY_ERROR = 2109, 1409
CRITICAL = frozenset({"base", "battery"})  # the robot does not move without these

# Fields of the message by the component that they describe.
SHOWN: Mapping[tuple[str, str], type[Component]] = {
    ("motion_manager", ""): Base,
    ("algorithm_manager", ""): Localization,
    ("device", "bms"): Battery,
    ("sensor", "lidar"): Lidar,
}
# Field and code for a component's faults; all others belong to "other devices".
PLACES: Mapping[str, tuple[str, str, int]] = {
    "base": ("motion_manager", "", BROKEN),
    "localization": ("algorithm_manager", "", BROKEN),
    "battery": ("device", "bms", BATTERY_ERROR),
    "lidar": ("sensor", "lidar", LIDAR_ERROR),
    "bumper": ("sensor", "others", BROKEN),
    "cliff": ("sensor", "others", BROKEN),
    "depth camera": ("sensor", "others", BROKEN),
    "range sensors": ("sensor", "others", BROKEN),
}
OTHER = ("device", "others", BROKEN)


def self_check(robot: Robot) -> tuple[SelfCheck, Errors]:
    """Return the overall code, and one for each part: 0 good, -1 unknown yet, anything else an error."""
    errors: Errors = {}
    for (group, part), component in SHOWN.items():
        if component in robot:
            _note(errors, group, part, GOOD)
    failed = {
        fault.component
        for fault in (robot[Health].faults if Health in robot else ())
        if fault.level > FaultLevel.WARNING
    }
    for name in failed:
        _note(errors, *PLACES.get(name, OTHER))
    if failed:
        return SelfCheck.CRITICAL_FAULT if failed & CRITICAL else SelfCheck.MINOR_FAULT, errors
    if Lidar in robot and robot[Lidar].scan is None:
        _note(errors, "sensor", "lidar", NOT_YET)
        return SelfCheck.CHECKING, errors
    return SelfCheck.GOOD, errors


def _note(errors: Errors, group: str, part: str, number: int) -> None:
    if not part:
        errors[group] = number
        return
    parts = errors.setdefault(group, {})
    assert isinstance(parts, dict)
    parts[part] = number
