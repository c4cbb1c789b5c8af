"""How a body on legs is held."""

from enum import StrEnum


class Posture(StrEnum):
    """How the body is held."""

    STANDING = "standing"
    SITTING = "sitting"
    LYING = "lying"
    LIMP = "limp"  # motors without torque after an emergency stop; only getting up leads out
    CHANGING = "changing"  # between postures, or performing a motion
