"""Sentences of errors."""

from __future__ import annotations

from roboglot.model.components.motion.emergency_stop import EmergencyStop
from roboglot.model.errors import ComponentMissing


def test_missing_component_is_named_in_words() -> None:
    assert str(ComponentMissing(EmergencyStop)) == "this robot has no emergency stop"
