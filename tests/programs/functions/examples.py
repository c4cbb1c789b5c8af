"""Examples of all functions, for the reference page and for the tests that play them. Knows no robot."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from pathlib import Path

from roboglot.programs.functions.moving.performing import RESULT_MOTIONS
from roboglot.programs.functions.table import ABILITIES
from roboglot.values import dataclass

# A quick call of each group, as an example of its log.
_LOGGED = {
    "audio": "audio.set_volume(40)",
    "bms": "bms.get_data()",
    "follow": "follow.cancel_follow()",
    "gesture": "gesture.turn_off_recognition()",
    "gps": "gps.get_data(1)",
    "imu": "imu.get_data()",
    "led": "led.freed(LedConstraint.target_tail)",
    "lidar": "lidar.get_data()",
    "motion": "motion.turn(10)",
    "navigation": "navigation.cancel_navigation()",
    "odometer": "odometer.get_data()",
    "personnel": "personnel.voiceprint_recognized([], False, 1)",
    "skeleton": "skeleton.turn_off_recognition()",
    "task": "task.start()",
    "tof": "tof.get_data()",
    "touch": "touch.get_data(1)",
    "train": "train.get_training_words_set()",
    "ultrasonic": "ultrasonic.get_data()",
}


@dataclass(frozen=True, slots=True)
class Example:
    """A program, its output, a part of its line in the task's log, and the people's actions meanwhile."""

    code: str
    prints: str = ""
    logs: str = ""
    when: str = ""


def examples() -> dict[str, Example]:
    """Return the examples by the function's name."""
    text = Path(__file__).with_suffix(".toml").read_text("utf-8")
    written = {
        name: Example(**fields | {"code": fields["code"].strip()}) for name, fields in tomllib.loads(text).items()
    }
    return dict(_families()) | written


def _families() -> Iterator[tuple[str, Example]]:
    for motion, _, _ in RESULT_MOTIONS:
        yield f"cyberdog.motion.{motion}", Example(f"print(cyberdog.motion.{motion}().response.result)", "True")
    for operation in ABILITIES:
        group, _, name = operation.key.removeprefix("cyberdog.").partition(".")
        if name == "set_log" and group in _LOGGED:
            called = _LOGGED[group].partition("(")[0]
            code = f"cyberdog.{group}.set_log(True)\ncyberdog.{_LOGGED[group]}"
            yield operation.key, Example(code, logs=f"cyberdog.{called}(")
        elif name == "state":
            yield operation.key, Example(f"print(cyberdog.{group}.state.code == StateCode.success)", "True")
