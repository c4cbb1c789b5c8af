"""Comparison of two values: exactly, as numbers within a tolerance, by their type alone, or not at all."""

from __future__ import annotations

import math
import re
from enum import StrEnum
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Annotated, Any

import msgspec

from roboglot.recording.comparing.trees import kind_of
from roboglot.recording.secrets import REDACTED
from roboglot.text_files import convert_toml, text_of
from roboglot.validation import why_invalid

RULES_MAX = 1000
# Values that differ in every session: UUIDs, dates, Unix times in s, ms, us or ns.
_volatile = re.compile(
    r"[0-9a-f]{8}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{4}-[0-9a-f]{12}"
    r"|.*\b\d{4}-\d\d-\d\d[T ]\d\d:\d\d.*|.*\b1[5-9]\d{8,17}\b.*",
    re.IGNORECASE | re.DOTALL,
)


class ComparisonMode(StrEnum):
    """Way to compare two values."""

    EXACT = "exact"
    NUMBER = "number"
    SHAPE = "shape"
    IGNORED = "ignored"


class Rule(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """For the fields ``field`` (a path like ``$.pose.x``, with ``*``) of the operations ``operation`` (with ``*``).

    ``tolerance`` is absolute, ``share`` a part of the larger value; the wider one counts.
    """

    compare: ComparisonMode
    operation: str = "*"
    field: str = "*"
    tolerance: Annotated[float, msgspec.Meta(ge=0)] = 0.0
    share: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.0


class Mask(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The first matching rule counts; without one, numbers have these tolerances and other values must be equal.

    ``seconds``, ``seconds_share``: absolute and relative tolerance of the times of answers and pushes. ``metres``,
    ``degrees``: tolerance of places, about the same time (``seconds``).
    """

    rule: tuple[Rule, ...] = ()
    tolerance: Annotated[float, msgspec.Meta(ge=0)] = 0.05
    share: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.05
    seconds: Annotated[float, msgspec.Meta(ge=0)] = 0.5
    seconds_share: Annotated[float, msgspec.Meta(ge=0, le=1)] = 0.25
    metres: Annotated[float, msgspec.Meta(ge=0)] = 0.1
    degrees: Annotated[float, msgspec.Meta(ge=0, le=180)] = 10.0

    def agree(self, operation: str, path: str, one: object, other: object) -> bool:
        """Return whether two values agree under this mask."""
        if (rule := self._rule(operation, path)) is not None:
            return _agree(rule.compare, one, other, rule.tolerance, rule.share)
        if is_volatile(one) and is_volatile(other):
            return True
        return _agree(ComparisonMode.NUMBER, one, other, self.tolerance, self.share)

    def how(self, operation: str, path: str) -> ComparisonMode | None:
        """Return the comparison that a rule sets for the field; None if no rule matches."""
        rule = self._rule(operation, path)
        return None if rule is None else rule.compare

    def _rule(self, operation: str, path: str) -> Rule | None:
        fits = (r for r in self.rule if fnmatchcase(operation, r.operation) and fnmatchcase(path, r.field))
        return next(fits, None)

    def in_time(self, one: float, other: float) -> bool:
        """Return whether two durations (s) agree within the tolerance."""
        return abs(one - other) <= max(self.seconds, self.seconds_share * max(abs(one), abs(other)))


STRICT = Mask(tolerance=0.0, share=0.0, seconds=1e-6, seconds_share=0.0, metres=0.0, degrees=0.0)


def read_mask(path: Path) -> Mask:
    """Read a TOML file. Raises ValueError, OSError."""
    try:
        mask = convert_toml(text_of(path), Mask)
    except ValueError as error:
        raise ValueError(f"{path}: {why_invalid(error, wanted=Mask)}") from None
    if len(mask.rule) > RULES_MAX:
        raise ValueError(f"{path}: more than {RULES_MAX} rules")
    return mask


def _agree(how: ComparisonMode, one: Any, other: Any, tolerance: float, share: float) -> bool:
    if how is ComparisonMode.IGNORED:
        return True
    if kind_of(one) != kind_of(other):
        return False
    if how is ComparisonMode.SHAPE:
        return True
    if how is ComparisonMode.NUMBER and kind_of(one) == "number":
        return math.isclose(one, other, rel_tol=share, abs_tol=tolerance)
    return bool(one == other)


def is_volatile(value: object) -> bool:
    """Return whether a value differs in every session: an id, a date, a Unix time."""
    if isinstance(value, bool):
        return False
    if isinstance(value, int | float):
        return bool(1.5e9 <= abs(value) < 2e9 or 1.5e12 <= abs(value) < 2e12 or 1.5e15 <= abs(value) < 2e15)
    return isinstance(value, str) and bool(_volatile.fullmatch(value))


def is_redacted(value: object) -> bool:
    """Return whether a recording left out this value, or part of it."""
    return isinstance(value, str) and REDACTED.decode() in value
