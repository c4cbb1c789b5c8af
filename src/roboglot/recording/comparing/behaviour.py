"""Compares the behaviour of two robots that did not get the same requests at the same time, operation by operation.

Compared are, for each operation and push: statuses, fields and their types, magnitudes and ranges of numbers, times of
answers, rates of pushes. Single values are not compared, as another robot is at another place.
"""

from __future__ import annotations

import re
import statistics
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import field

from roboglot.model.tap import Exchange
from roboglot.recording.comparing.comparison import MISSING, Comparison, Row, compare_order
from roboglot.recording.comparing.masks import ComparisonMode, Mask, is_volatile
from roboglot.recording.comparing.trees import kind_of, leaves, tree
from roboglot.recording.reader import pair
from roboglot.values import dataclass

MAGNITUDE = 10.0  # times; larger differences suggest another unit
SMALL = 1e-3  # below this, numbers have no magnitude
RANGE_MIN = 5  # values required on both sides to compare ranges
SLACK = 0.25  # of a range, at both ends
PUSHES_MIN = 4  # of a kind on both sides, required to compare rates
RATE_SHARE = 0.25
FIELDS_MAX = 2000  # per operation
_index = re.compile(r"\[\d+\]")
_own_name = re.compile(r"\.(?:[0-9a-fA-F-]{12,}|\d+)(?=[.\[]|$)")  # of an object whose keys are ids


@dataclass(slots=True)
class Field:
    """The values of one field: number of occurrences, types, numbers."""

    kinds: set[str] = field(default_factory=set)
    numbers: list[float] = field(default_factory=list)

    @property
    def size(self) -> float:
        """Median magnitude of the numbers."""
        return statistics.median(map(abs, self.numbers))


@dataclass(slots=True)
class Profile:
    """Observations of one operation."""

    count: int = 0
    statuses: set[str] = field(default_factory=set)
    fields: dict[str, Field] = field(default_factory=dict)
    seconds: list[float] = field(default_factory=list)  # until each answer
    stamps: list[float] = field(default_factory=list)  # of each push

    def note(self, payload: bytes) -> None:
        """Add the values of one message."""
        for path, value in leaves(tree(payload)):
            name = _own_name.sub(".*", _index.sub("[]", path))
            if name not in self.fields and len(self.fields) >= FIELDS_MAX:
                return
            found = self.fields.setdefault(name, Field())
            found.kinds.add(kind_of(value))
            if kind_of(value) == "number" and not is_volatile(value):
                found.numbers.append(float(value))

    @property
    def rate(self) -> float:
        """Pushes per second."""
        span = max(self.stamps) - min(self.stamps)
        return (len(self.stamps) - 1) / span if span > 0 else 0.0


Profiles = dict[tuple[str, str], Profile]


def profiles(exchanges: Sequence[Exchange]) -> Profiles:
    """Return profiles by door and operation."""
    found: Profiles = defaultdict(Profile)
    asked, pushes = pair(exchanges)
    for one in asked:
        profile = found[one.request.door, one.request.operation]
        profile.count += 1
        if not one.replies:
            profile.statuses.add("no answer")
        for reply in one.replies:
            profile.statuses.add(reply.status)
            profile.seconds.append(reply.seconds)
            profile.note(reply.payload)
    for _, push in pushes:
        profile = found[push.door, push.operation]
        profile.count += 1
        profile.stamps.append(push.stamp)
        profile.note(push.payload)
    return dict(found)


def compare_behaviour(one: Sequence[Exchange], other: Sequence[Exchange], mask: Mask | None = None) -> Comparison:
    """Compare two sessions, of one robot each, by the behaviour that they show."""
    mask = mask or Mask()
    mine, theirs = profiles(one), profiles(other)
    rows: dict[tuple[str, str], Row] = {}
    for key in sorted(mine.keys() | theirs.keys()):
        row = rows[key] = Row(*key)
        a, b = mine.get(key), theirs.get(key)
        row.ones, row.others = a.count if a else 0, b.count if b else 0
        if a is None or b is None:
            row.check(False, "operation", f"{row.ones} times", f"{row.others} times")
        else:
            _compare_profiles(row, a, b, mask)
    compare_order(rows, one, other)
    return Comparison([rows[key] for key in sorted(rows)])


def _compare_profiles(row: Row, one: Profile, other: Profile, mask: Mask) -> None:
    if one.statuses or other.statuses:
        row.check(one.statuses == other.statuses, "statuses", _words(one.statuses), _words(other.statuses))
    for path in sorted(one.fields.keys() | other.fields.keys()):
        _compare_field(row, path, one.fields, other.fields, mask)
    if one.seconds and other.seconds:
        a, b = statistics.median(one.seconds), statistics.median(other.seconds)
        row.check(mask.in_time(a, b), "seconds to the answer (median)", round(a, 3), round(b, 3))
    if min(len(one.stamps), len(other.stamps)) >= PUSHES_MIN:
        a, b = one.rate, other.rate
        row.check(abs(a - b) <= RATE_SHARE * max(a, b), "pushes a second", round(a, 2), round(b, 2))


def _compare_field(row: Row, path: str, ones: dict[str, Field], others: dict[str, Field], mask: Mask) -> None:
    rule = mask.how(row.operation, path)
    if rule is ComparisonMode.IGNORED or _in_empty(path, ones) or _in_empty(path, others):
        return
    one, other = ones.get(path), others.get(path)
    if one is None or other is None:
        if _is_filled(path, ones) or _is_filled(path, others):
            return  # empty here, filled there
        there = "there"
        row.check(False, path, there if one else MISSING, there if other else MISSING)
        return
    row.check(bool(one.kinds & other.kinds), f"{path} (type)", _words(one.kinds), _words(other.kinds))
    if rule is not ComparisonMode.SHAPE and one.numbers and other.numbers:
        _compare_numbers(row, path, one, other)


def _compare_numbers(row: Row, path: str, one: Field, other: Field) -> None:
    small, large = sorted((one.size, other.size))
    row.check(
        small < SMALL or large <= MAGNITUDE * small or large < 1.0, f"{path} (magnitude)", _figure(one), _figure(other)
    )
    if min(len(one.numbers), len(other.numbers)) < RANGE_MIN:
        return
    (low, high), (least, most) = ((min(f.numbers), max(f.numbers)) for f in (one, other))
    slack = SLACK * max(high - low, most - least, abs(high), abs(most), SMALL)
    apart = least - slack > high or low - slack > most
    row.check(not apart, f"{path} (range)", f"{low:g} to {high:g}", f"{least:g} to {most:g}")


def _in_empty(path: str, fields: dict[str, Field]) -> bool:
    """Return whether an enclosing list or object was always empty, or absent instead of null."""
    for end in range(len(path) - 1, 0, -1):
        if path[end] in ".[":
            found = fields.get(path[:end])
            if found is not None and found.kinds <= {"array", "object", "null"}:
                return path not in fields
    return False


def _is_filled(path: str, fields: dict[str, Field]) -> bool:
    return any(name.startswith((f"{path}.", f"{path}[")) for name in fields)


def _words(found: set[str]) -> str:
    return ", ".join(sorted(found)) or "none"


def _figure(found: Field) -> str:
    return f"about {found.size:g}"
