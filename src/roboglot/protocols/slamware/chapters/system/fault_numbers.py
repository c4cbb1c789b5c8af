"""Chapter "system": the vendor's numbers and levels of faults. Knows no socket."""

from __future__ import annotations

from roboglot.model.components.system.health import Fault, FaultLevel
from roboglot.wire.slamware.chapters.system.system import BaseError, HealthPart, Level, health_record

LASTING = 2.0  # s
STOP = "emergency stop"  # the fault
LEVELS = {FaultLevel.WARNING: Level.WARN, FaultLevel.ERROR: Level.ERROR, FaultLevel.FATAL: Level.FATAL}
# Level, component, code and the number within the component, by the model's name of the fault, where known from robots.
NUMBERS = {
    STOP: (Level.ERROR, HealthPart.SYSTEM, 0x0100, 1),
    "brake released": (Level.ERROR, HealthPart.SYSTEM, 0x0700, 7),
    "not localized": (Level.ERROR, HealthPart.SYSTEM, 0x0900, 9),
    "battery low": (Level.WARN, HealthPart.POWER, 0x0100, 2),
    "motor alarm": (Level.ERROR, HealthPart.MOTION, 0x0100, 1),
    "bumper stuck": (Level.ERROR, HealthPart.SENSOR, 0x0100, 1),
}
# All others have numbers of our own: code 0x70xx, counted here.
OWN = (
    "fallen", "battery empty", "battery hot", "cliff", "jack alarm", "network lost", "disk full", "lidar lost",
    "motor hot", "network slow", "depth camera lost", "range sensor lost", "navigation unavailable",
)  # fmt: skip
OWN_PARTS = {
    "battery": HealthPart.POWER,
    "base": HealthPart.MOTION,
    "motors": HealthPart.MOTION,
    "jack": HealthPart.MOTION,
    "lidar": HealthPart.SENSOR,
    "cliff": HealthPart.SENSOR,
    "depth camera": HealthPart.SENSOR,
    "range sensors": HealthPart.SENSOR,
}
OWN_CODE, UNKNOWN_CODE = 0x7000, 0x70FF


def record_of(fault: Fault) -> BaseError:
    """Return a fault in the API's form."""
    if fault.name in NUMBERS:
        level, part, code, kind = NUMBERS[fault.name]
        return health_record(level, part, code, kind, fault.message)
    code = OWN_CODE + OWN.index(fault.name) if fault.name in OWN else UNKNOWN_CODE
    part = OWN_PARTS.get(fault.component, HealthPart.SYSTEM)
    return health_record(LEVELS[fault.level], part, code, code & 0xFF, fault.message)


def is_error(fault: Fault, now: float) -> bool:
    """Return whether clients see an error or worse in a fault at ``now`` (robot time, s).

    What is a warning in the model counts once it lasts: the robot goes on while it doubts its place for a moment.
    """
    severe = record_of(fault).level in (Level.ERROR, Level.FATAL)
    return severe and (fault.level >= FaultLevel.ERROR or now - fault.since >= LASTING)
