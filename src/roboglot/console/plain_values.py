"""The model's values as plain JSON values: numbers, words, lists; one place, so that all views are consistent."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from enum import Enum

import msgspec

from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.geometry import Path, Point, Pose

TEXT_MAX = 300  # characters of a value without a better form
ENTRIES_MAX = 50  # entries shown of a list


def number(value: float) -> float | None:
    """Return ``value`` to three places; None for infinity and NaN."""
    return round(float(value), 3) if math.isfinite(value) else None


def pose(value: Pose) -> list[float | None]:
    """Return [x m, y m, yaw rad]."""
    return [number(value.x), number(value.y), number(value.yaw)]


def points(values: Sequence[Point]) -> list[list[float | None]]:
    """Return [[x, y], …] in m."""
    return [[number(p.x), number(p.y)] for p in values]


def action(value: Action, now: float) -> dict[str, object]:
    """Return an action: name, client, progress, and reason of its end."""
    status = "PAUSED" if value.paused else ActionStatus(value.status).name
    seconds = (value.ended_at if value.status.ended else now) - value.started_at
    return {
        "id": value.id,
        "name": value.name,
        "client": value.client,
        "status": status,
        "goal": plain(value.goal),
        "feedback": feedback(value.feedback),
        "reason": value.reason,
        "seconds": round(seconds, 1),
    }


def feedback(value: object) -> object:
    """Return an action's progress; for navigation, stage, m and s to go."""
    if isinstance(value, NavigationFeedback):
        left = {"meters": number(value.remaining.length), "seconds": number(value.time_to_goal)}
        return {"stage": value.stage, **left, "goals": points(value.milestones)}
    return plain(value)


def plain(value: object) -> object:
    """Return a value of the model as JSON, shortened if too long."""
    match value:
        case None | bool() | int():
            return value
        case float():
            return number(value)
        case Enum():
            return value.value if isinstance(value.value, str) else value.name
        case str():
            return value[:TEXT_MAX]
        case Path():
            return {"meters": number(value.length)}
        case Mapping():
            return {str(key): plain(entry) for key, entry in list(value.items())[:ENTRIES_MAX]}
        case list() | tuple() | set() | frozenset():
            return [plain(entry) for entry in list(value)[:ENTRIES_MAX]]
    if dataclasses.is_dataclass(value) and not isinstance(value, type):
        return {field.name: plain(getattr(value, field.name)) for field in dataclasses.fields(value)}
    if isinstance(value, msgspec.Struct):
        return {name: plain(field) for name, field in msgspec.structs.asdict(value).items()}
    return str(value)[:TEXT_MAX]
