"""Commands that stop the robot, or a part of it; they do not wait for other clients."""

from __future__ import annotations

from roboglot.wire.robomaster.commands import Malformed, parse

SPEEDS = frozenset({"chassis speed", "chassis wheel", "gimbal speed"})  # with zeros only


def stops(text: str | None) -> bool:
    """Return whether a command (None: too long a line) is one to stop."""
    try:
        keys = parse(text or "").keys
    except Malformed:
        return False
    return any(key == "quit" or key.endswith(" stop") or (key in SPEEDS and _zeros(words[1::2])) for key, words in keys)


def _zeros(values: tuple[str, ...]) -> bool:
    try:
        return bool(values) and not any(map(float, values))
    except ValueError:
        return False
