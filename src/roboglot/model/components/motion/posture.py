"""Postures of a legged body."""

from enum import StrEnum


class Posture(StrEnum):
    """Posture of a legged body."""

    STANDING = "standing"
    SITTING = "sitting"
    LYING = "lying"
    LIMP = "limp"  # motors without torque after an emergency stop; the only way out is to get up
    CHANGING = "changing"  # between postures, or performing a motion
