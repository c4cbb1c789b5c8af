"""JSON schemas: the vendor's spelling, and what clients in the field really send."""

import math
from typing import TypeVar

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.wire.slamware.chapters.artifact import PoseEntry, metadata_text
from roboglot.wire.slamware.chapters.motion import MoveByOptions, MoveOptions, MoveToOptions
from roboglot.wire.slamware.chapters.system.system import (
    DockingStatus,
    HealthPart,
    Level,
    PowerStatus,
    error_code,
    health_record,
)
from roboglot.wire.slamware.geometry import Pose2D

T = TypeVar("T")


def convert(value: object, kind: type[T]) -> T:
    return msgspec.convert(value, kind, strict=False)


def test_names_are_spelled_as_the_vendor_does() -> None:
    power = PowerStatus(90, DockingStatus.ON_DOCK, True, False, "running", "awake")
    assert msgspec.to_builtins(power) == {
        "batteryPercentage": 90,
        "dockingStatus": "on_dock",
        "isCharging": True,
        "isDCConnected": False,
        "powerStage": "running",
        "sleepMode": "awake",
    }


def test_error_numbers_are_composed_as_published() -> None:
    assert error_code(Level.ERROR, HealthPart.SYSTEM, 0x0700) == 33621760  # the manual's example
    low = health_record(Level.WARN, HealthPart.POWER, 0x0100, 2, "power low")
    assert (low.error_code, low.component_error_type) == (0x01020100, 3074)


@pytest.mark.parametrize("flags", [0, None, [], [None]])
def test_no_flags_come_in_four_spellings(flags: object) -> None:
    assert not convert({"flags": flags}, MoveOptions).has("with_yaw")


def test_a_flag_is_found_among_others() -> None:
    assert convert({"mode": 0, "flags": ["precise", "with_yaw"]}, MoveOptions).has("with_yaw")


def test_unknown_fields_are_ignored() -> None:
    options = convert({"direction": 3, "linear_velocity": 0.2, "speed_ratio": 1}, MoveByOptions)
    assert options.direction == 3
    assert convert({"target": {"x": 1, "y": 2, "z": 0, "w": 5}, "more": []}, MoveToOptions).target.y == 2


@pytest.mark.parametrize("bad", ["nan", "inf", math.nan, math.inf, 1e9, None, {}, "one"])
def test_no_number_gets_in_that_is_none(bad: object) -> None:
    with pytest.raises(msgspec.ValidationError):
        convert({"x": bad, "y": 0}, Pose2D)


@pytest.mark.parametrize(
    ("metadata", "text"),
    [({}, {}), ([], {}), (None, {}), ({"a": "b", "n": 5, "t": True}, {"a": "b", "n": "5", "t": "true"})],
)
def test_metadata_becomes_text(metadata: object, text: dict[str, str]) -> None:
    assert metadata_text(convert({"id": "p", "metadata": metadata}, PoseEntry).metadata) == text


JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
    max_leaves=8,
)


@given(st.dictionaries(st.sampled_from(["id", "pose", "metadata", "x", "y", "flags", "target", "move_options"]), JSON))
def test_any_json_is_taken_or_refused(value: object) -> None:
    for kind in (PoseEntry, MoveToOptions, MoveOptions, MoveByOptions):
        try:
            convert(value, kind)
        except msgspec.ValidationError:
            continue
