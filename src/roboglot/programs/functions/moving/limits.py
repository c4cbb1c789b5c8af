"""Limits of motions: the manual's table 4.1. Numbers only; outside of them the robot does not move."""

from __future__ import annotations

from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Range:
    """One row of the table. The manual's "resolution" is a display's step: values are never rounded to it."""

    minimum: float
    default: float
    maximum: float
    unit: str
    open_end: bool = False  # the maximum itself is excluded

    def __contains__(self, value: float) -> bool:
        return self.minimum <= value < self.maximum or (value == self.maximum and not self.open_end)


WALK_DURATION_MAX = 3600.0  # s; the table states 6, yet the manual's examples walk for 10 and the firmware for an hour

LIMITS: dict[str, Range] = {
    "centroid_x": Range(-0.4, 0.0, 0.4, "m"),
    "centroid_y": Range(-0.3, 0.0, 0.3, "m"),
    "centroid_z": Range(0.1, 0.2, 0.3, "m"),  # the table's default of 0 lies outside its own range
    "fulcrum_x": Range(-0.5, 0.0, 0.5, "m"),
    "fulcrum_y": Range(-0.5, 0.0, 0.5, "m"),
    "fulcrum_z": Range(-0.5, 0.0, 0.5, "m"),
    "roll": Range(-25.8, 0.0, 25.8, "deg"),
    "pitch": Range(-25.8, 0.0, 25.8, "deg"),
    "yaw": Range(-25.8, 0.0, 25.8, "deg"),
    "x_velocity": Range(-1.6, 0.0, 1.6, "m/s"),
    "y_velocity": Range(-1.2, 0.0, 1.2, "m/s"),
    "z_velocity": Range(-114.6, 0.0, 114.6, "deg/s"),
    "front_leg_lift": Range(0.005, 0.03, 0.1, "m"),
    "back_leg_lift": Range(0.005, 0.03, 0.1, "m"),
    "distance": Range(0.0, 0.0, 10.0, "m"),
    "duration": Range(0.0, 1.0, 6.0, "s"),
    "delta": Range(0.1, 10.0, 100.0, "per"),
}
# For relative motions and for gaits that jump; not part of any MotionParams.
OTHERS: dict[str, Range] = {
    "x_jump_velocity": Range(-0.25, 0.0, 0.15, "m/s"),
    "y_jump_velocity": Range(-0.1, 0.0, 0.1, "m/s"),
    "z_jump_velocity": Range(-28.65, 0.0, 28.65, "deg/s"),
    "relative_centroid_z": Range(-0.2, 0.0, 0.2, "m"),
    "relative_roll": Range(-51.6, 0.0, 51.6, "deg"),
    "relative_pitch": Range(-51.6, 0.0, 51.6, "deg"),
    "relative_yaw": Range(-51.6, 0.0, 51.6, "deg"),
}
TURN_ANGLE = Range(-360.0, 0.0, 360.0, "deg", open_end=True)
WALK_DURATION = Range(0.0, 1.0, WALK_DURATION_MAX, "s")


def outside(**values: float) -> str:
    """Return the first violation of a range, in plain words; empty without one. NaN is outside of all ranges."""
    ranges = LIMITS | OTHERS | {"angle": TURN_ANGLE, "walk_duration": WALK_DURATION}
    for name, value in values.items():
        if value not in (limit := ranges[name]):
            name = name.removeprefix("walk_").removeprefix("relative_")
            given, least, most = f"{name} = {value:g}", f"{limit.minimum:g}", f"{limit.maximum:g} {limit.unit}"
            why = f"{given} is outside of {least} to {most}"
            if limit.open_end:
                why = f"{given} is outside of {least} to less than {most}"
            return why
    return ""
