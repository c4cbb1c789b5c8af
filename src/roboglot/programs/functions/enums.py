"""The manual's enumerations, available to programs by name (4.2). Numbers only."""

from __future__ import annotations

from collections.abc import Mapping

from roboglot.programs.functions.results import StateCode

# GestureType counts from 1 in this order; the shipped firmware orders its last four differently.
GESTURES = (
    "pulling_hand_or_two_fingers_in",
    "pushing_hand_or_two_fingers_away",
    "sliding_hand_or_two_fingers_up",
    "sliding_hand_or_two_fingers_down",
    "sliding_hand_or_two_fingers_left",
    "sliding_hand_or_two_fingers_right",
    "stop_sign",
    "thumb_down",
    "thumb_up",
    "zooming_in_with_hand_or_two_fingers",
    "zooming_out_with_hand_or_two_fingers",
)
SPORTS = ("squat", "highknees", "situp", "pressup", "plank", "jumpjack")  # SkeletonType, from 1

# LedConstraint: the manual gives the names, the firmware the numbers.
LED_TARGETS = {"target_head": 1, "target_tail": 2, "target_mini": 3}
LINE_EFFECTS = ("on", "blink", "blink_fast", "breath", "breath_fast", "one_by_one", "one_by_one_fast")  # from 1
SYSTEM_COLOURS = ("red", "blue", "yellow")  # from 161; each supports all line effects
LINE_OFF, LINE_FIRST = 160, 161
EYE_EFFECTS = {"effect_mini_circular_breath": 48, "effect_mini_circular_ring": 49}
EYE_SYSTEM_EFFECTS = {
    "system_effect_mini_off": 50,
    "system_effect_mini_rectangle_color": 51,
    "system_effect_mini_centre_color": 52,
    "system_effect_mini_three_circular": 53,
    "system_effect_mini_one_by_one": 54,
}
_SYSTEM_LINES = (f"system_effect_line_{colour}_{effect}" for colour in SYSTEM_COLOURS for effect in LINE_EFFECTS)

ENUMS: Mapping[str, Mapping[str, int]] = {
    "StateCode": {code.name.lower(): int(code) for code in StateCode},
    "GestureType": {"no_gesture": 0} | {name: number for number, name in enumerate(GESTURES, 1)},
    "SkeletonType": {name: number for number, name in enumerate(SPORTS, 1)},
    "LedConstraint": {
        **LED_TARGETS,
        **{f"effect_line_{effect}": number for number, effect in enumerate(LINE_EFFECTS, 1)},
        "system_effect_line_off": LINE_OFF,
        **{name: number for number, name in enumerate(_SYSTEM_LINES, LINE_FIRST)},
        **EYE_EFFECTS,
        **EYE_SYSTEM_EFFECTS,
    },
}
