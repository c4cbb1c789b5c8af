"""Sentences of errors."""

from __future__ import annotations

from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.errors import ComponentMissing, NotFound


def test_missing_component_is_named_in_words() -> None:
    assert str(ComponentMissing(EmergencyStop)) == "this robot has no emergency stop"


def test_long_message_is_cut_off() -> None:
    assert str(NotFound(f"there is no place {'x' * 100_000!r}")).endswith("xxx … (100020 characters)")
    assert str(NotFound("there is no place 'x'")) == "there is no place 'x'"
