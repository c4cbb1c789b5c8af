"""Ranges of a block's fields: from table 4.1 if given there, otherwise the functions' own limits.

Numbers only, for editors; the functions themselves refuse values out of range.
"""

from __future__ import annotations

from roboglot.programs.functions.audio import BARKS, PIECES
from roboglot.programs.functions.enums import ENUMS, LED_TARGETS
from roboglot.programs.functions.moving.limits import LIMITS, OTHERS, TURN_ANGLE, WALK_DURATION
from roboglot.programs.functions.senses import gestures, people, skeletons
from roboglot.programs.functions.senses.sensors import TIMEOUT_MAX
from roboglot.values import dataclass

RELATIVE = ("relatively_force_control_attitude", "relatively_position_control_attitude")
ATTITUDES = ("absolute_attitude", "transition_standing", *RELATIVE)
COUNTING = ("turn_on_recognition", "blocking_recognized", "sports_recognition", "training_words_recognized")
STRIDE_MAX, DANCES_MAX = 0.065, 10  # of the choreographer, which clips larger values


@dataclass(frozen=True, slots=True)
class Limit:
    """Range of a number; ``start``: value in a new block if the function has no default."""

    minimum: float
    maximum: float
    start: float | None = None


ANY: dict[str, Limit] = {
    **{name: Limit(limit.minimum, limit.maximum) for name, limit in (LIMITS | OTHERS).items()},
    "angle": Limit(TURN_ANGLE.minimum, 359.9),
    "volume": Limit(-1, 100),
    **dict.fromkeys("rgb", Limit(0, 255, 255)),
    "timeout": Limit(0, TIMEOUT_MAX),
    "counts": Limit(1, skeletons.COUNTS_MAX, 5),
    "intimacy": Limit(0, 5),
    "sensitivity": Limit(0, people.SENSITIVITY_MAX),
}
_LOOKING = Limit(gestures.DURATION_MIN, gestures.DURATION_MAX)
_COUNTING = Limit(skeletons.TIMEOUT_MIN, skeletons.TIMEOUT_MAX)
_POSE = Limit(-1000, 1000)
OWN: dict[tuple[str, str], Limit] = {
    ("turn", "duration"): Limit(0, LIMITS["duration"].maximum),
    **{(name, "duration"): Limit(0, LIMITS["duration"].maximum) for name in ATTITUDES},
    **{
        (name, part): Limit(OTHERS[f"relative_{part}"].minimum, OTHERS[f"relative_{part}"].maximum)
        for name in RELATIVE
        for part in ("centroid_z", "roll", "pitch", "yaw")
    },
    **{("navigation_to_coordinates", part): _POSE for part in ("x", "y", "z", "roll", "pitch", "yaw")},
    ("turn_on_recognition", "duration"): _LOOKING,
    ("recognized", "duration"): _LOOKING,
    ("recognized_any_gesture", "timeout"): _LOOKING,
    ("recognized_designated_gesture", "timeout"): Limit(1, gestures.DURATION_MAX),
    **{(name, "timeout"): _COUNTING for name in COUNTING},
    **{(name, "volume"): Limit(0, 100) for name in ("sports_recognition", "to_preset", "turn_on_navigation")},
    ("face_recognized", "duration"): Limit(30, 300),
    ("voiceprint_recognized", "duration"): Limit(1, 30),
    ("moonwalk", "x_velocity"): Limit(-0.08, 0.08, 0.05),
    ("moonwalk", "y_velocity"): Limit(-0.05, 0.05, 0),
    ("moonwalk", "stride"): Limit(0.001, STRIDE_MAX, 0.03),
    ("moonwalk", "number"): Limit(1, DANCES_MAX, 2),
    ("push_up", "frequency"): Limit(10, 60, 30),
    ("push_up", "number"): Limit(2, DANCES_MAX, 2),
}
WALK = Limit(WALK_DURATION.minimum, WALK_DURATION.maximum)  # all other durations belong to walks

CHOICES: dict[str, tuple[str, tuple[str, ...]]] = {
    "target": ("LedConstraint", tuple(LED_TARGETS)),
    "gesture_type": ("GestureType", tuple(name for name in ENUMS["GestureType"] if name != "no_gesture")),
    "sport_type": ("SkeletonType", tuple(ENUMS["SkeletonType"])),
}
EFFECTS = {
    "play": tuple(name for name in ENUMS["LedConstraint"] if name.startswith("system_effect")),
    "play_rgb": tuple(name for name in ENUMS["LedConstraint"] if name.startswith("effect")),
}
SOUNDS = tuple(str(number) for number in sorted([*BARKS, *PIECES]))


def limit_of(function: str, parameter: str) -> Limit | None:
    """Return the range of a number; None: unlimited; ``function`` without its group."""
    if (function, parameter) in OWN:
        return OWN[function, parameter]
    return WALK if parameter == "duration" else ANY.get(parameter)


def choices_of(function: str, parameter: str) -> tuple[str, tuple[str, ...]] | None:
    """Return a choice's enumeration with its members, or "" with numbers; None for other parameters."""
    if parameter == "effect":
        return "LedConstraint", EFFECTS[function]
    return ("", SOUNDS) if parameter == "audio_id" else CHOICES.get(parameter)
