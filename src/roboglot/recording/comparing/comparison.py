"""Compares two sessions: pairs equal requests, then compares status, values and times of answers, and pushes."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import field
from itertools import pairwise

from roboglot.model.tap import Direction, Exchange
from roboglot.recording.comparing.ids import IdMap
from roboglot.recording.comparing.masks import ComparisonMode, Mask, is_redacted
from roboglot.recording.comparing.trees import leaves, tree
from roboglot.recording.matching import normal
from roboglot.recording.reader import AnsweredRequest, pair
from roboglot.values import dataclass

SHOWN_MAX = 20  # differences kept per operation
VALUE_MAX = 80  # characters of a value in a report
MISSING = "(not there)"


@dataclass(frozen=True, slots=True)
class Difference:
    """A difference between two recordings: its place, and both values as text."""

    what: str
    one: str
    other: str


@dataclass(slots=True)
class Row:
    """One operation or push of one door: its count in each session, and the share that agrees."""

    door: str
    operation: str
    ones: int = 0
    others: int = 0
    checks: int = 0
    agreed: int = 0
    differences: list[Difference] = field(default_factory=list)

    def check(self, good: bool, what: str, one: object, other: object) -> None:
        """Count one comparison."""
        self.checks += 1
        if good:
            self.agreed += 1
        else:
            self.note(what, one, other)

    def note(self, what: str, one: object, other: object) -> None:
        """Keep a difference for the report; at most ``SHOWN_MAX`` are kept."""
        if len(self.differences) < SHOWN_MAX:
            self.differences.append(Difference(what, _short(one), _short(other)))

    @property
    def share(self) -> float:
        """Share of comparisons that agree, 0 to 1; 1.0 if nothing was compared."""
        return self.agreed / self.checks if self.checks else 1.0

    @property
    def compared(self) -> bool:
        """False if only one session has this row."""
        return self.ones > 0 and self.others > 0


@dataclass(slots=True)
class Comparison:
    """All rows of messages, by door and operation, and those of what the robots did.

    ``figures``: what was compared of the robots' places, in words; ``reason``: why they were not compared. ``robot``:
    the only one compared; ``notes``: what could not be read of the recordings.
    """

    rows: list[Row]
    drive: list[Row] = field(default_factory=list)
    figures: str = ""
    reason: str = ""
    robot: str = ""
    notes: list[str] = field(default_factory=list)

    @property
    def messages(self) -> float:
        """Share of the messages' comparisons that agree, 0 to 1; 1.0 if nothing was compared."""
        checks = sum(row.checks for row in self.rows)
        return sum(row.agreed for row in self.rows) / checks if checks else 1.0

    @property
    def driven(self) -> float:
        """The smallest share that agrees among the rows of ``drive``; 1.0 if nothing was compared."""
        return min((row.share for row in self.drive), default=1.0)

    @property
    def fidelity(self) -> float:
        """The smaller share of messages and drive, so that many equal messages cannot hide a different drive."""
        return min(self.messages, self.driven)

    @property
    def empty(self) -> bool:
        """True if nothing was compared."""
        return not any(row.checks for row in (*self.rows, *self.drive))

    def passes(self, least: float) -> bool:
        """Return whether anything was compared, and at least ``least`` percent of it agree."""
        return not self.empty and self.fidelity * 100 >= least

    @property
    def differs(self) -> bool:
        """True if any comparison does not agree."""
        return any(row.agreed < row.checks for row in (*self.rows, *self.drive))

    def of(self, door: str) -> Comparison:
        """Return a comparison with the rows of one door."""
        return Comparison([row for row in self.rows if row.door == door])

    @property
    def doors(self) -> list[str]:
        """Names of the doors, sorted."""
        return sorted({row.door for row in self.rows})


def compare(
    one: Sequence[Exchange],
    other: Sequence[Exchange],
    mask: Mask | None = None,
    *,
    order: bool = True,
    ids: IdMap | None = None,
) -> Comparison:
    """Compare two sessions, of one robot each; ``order``: compare the order of operations, too.

    ``ids``: they agree if each stands for the same one throughout, as where one session repeats the other; None: they
    are compared as other values are, and any two UUIDs agree.
    """
    mask = mask or Mask()
    rows: dict[tuple[str, str], Row] = {}
    asked_one, pushed_one = pair(one)
    asked_other, pushed_other = pair(other)
    starts = _start(one), _start(other)
    _compare_answers(rows, asked_one, asked_other, mask, ids)
    _compare_pushes(rows, [e for _, e in pushed_one], [e for _, e in pushed_other], starts, mask)
    if order:
        compare_order(rows, one, other)
    return Comparison(sorted(rows.values(), key=lambda row: (row.door, row.operation)))


def answers_only(exchanges: Sequence[Exchange]) -> list[Exchange]:
    """Return a session without pushes: a replay of its requests does not receive them in the same way."""
    return [exchange for exchange in exchanges if exchange.direction is not Direction.PUSH]


def _row(rows: dict[tuple[str, str], Row], exchange: Exchange) -> Row:
    key = exchange.door, exchange.operation
    return rows.setdefault(key, Row(*key))


def _start(exchanges: Sequence[Exchange]) -> float:
    return exchanges[0].stamp if exchanges else 0.0


def _compare_answers(
    rows: dict[tuple[str, str], Row],
    ones: Sequence[AnsweredRequest],
    others: Sequence[AnsweredRequest],
    mask: Mask,
    ids: IdMap | None,
) -> None:
    left: dict[tuple[str, str, str], list[AnsweredRequest]] = defaultdict(list)
    for asked in others:
        _row(rows, asked.request).others += 1
        left[_key(asked)].append(asked)
    for asked in ones:
        row = _row(rows, asked.request)
        row.ones += 1
        alike = left[_key(asked)]
        if alike:
            _compare_replies(row, asked, alike.pop(0), mask, ids)
        else:
            row.check(False, "request", asked.request.payload, MISSING)
    for alike in left.values():
        for asked in alike:
            _row(rows, asked.request).check(False, "request", MISSING, asked.request.payload)


def _key(asked: AnsweredRequest) -> tuple[str, str, str]:
    request = asked.request
    return request.door, request.operation, normal(request.door, request.payload).text


def _compare_replies(row: Row, one: AnsweredRequest, other: AnsweredRequest, mask: Mask, ids: IdMap | None) -> None:
    row.check(len(one.replies) == len(other.replies), "number of replies", len(one.replies), len(other.replies))
    for mine, theirs in zip(one.replies, other.replies, strict=False):
        row.check(mine.status == theirs.status, "status", mine.status, theirs.status)
        row.check(mask.in_time(mine.seconds, theirs.seconds), "seconds", mine.seconds, theirs.seconds)
        _compare_payloads(row, mine.payload, theirs.payload, mask, ids)


def _compare_payloads(row: Row, one: bytes, other: bytes, mask: Mask, ids: IdMap | None = None) -> None:
    mine, theirs = dict(leaves(tree(one))), dict(leaves(tree(other)))
    for path in mine | theirs:
        a, b = mine.get(path, MISSING), theirs.get(path, MISSING)
        if mask.how(row.operation, path) is ComparisonMode.IGNORED:  # there or not
            good = True
        elif path not in mine or path not in theirs:
            good = False
        elif is_redacted(a) != is_redacted(b):
            continue  # one of them is not known
        else:
            named = ids.agree(path, a, b) if ids is not None and mask.how(row.operation, path) is None else None
            good = mask.agree(row.operation, path, a, b) if named is None else named
        row.check(good, path, a, b)


def _compare_pushes(
    rows: dict[tuple[str, str], Row],
    ones: Sequence[Exchange],
    others: Sequence[Exchange],
    starts: tuple[float, float],
    mask: Mask,
) -> None:
    mine, theirs = _by_operation(ones), _by_operation(others)
    for key in sorted(mine.keys() | theirs.keys()):
        row = rows.setdefault(key, Row(*key))
        a, b = mine.get(key, []), theirs.get(key, [])
        row.ones += len(a)
        row.others += len(b)
        row.check(len(a) == len(b), "number of pushes", len(a), len(b))
        for one, other in zip(a, b, strict=False):
            since, after = one.stamp - starts[0], other.stamp - starts[1]
            row.check(abs(since - after) <= mask.seconds, "time of the push", since, after)
            _compare_payloads(row, one.payload, other.payload, mask)


def _by_operation(pushes: Sequence[Exchange]) -> dict[tuple[str, str], list[Exchange]]:
    found: dict[tuple[str, str], list[Exchange]] = defaultdict(list)
    for push in pushes:
        found[push.door, push.operation].append(push)
    return found


def compare_order(rows: dict[tuple[str, str], Row], one: Sequence[Exchange], other: Sequence[Exchange]) -> None:
    """Compare the order of the operations that both sessions have."""
    firsts = [_first_places(one), _first_places(other)]
    shared = sorted(firsts[0].keys() & firsts[1].keys(), key=lambda key: firsts[0][key])
    for before, after in pairwise(shared):
        kept = firsts[1][before] < firsts[1][after]
        row = rows.setdefault(after[:2], Row(*after[:2]))
        row.check(kept, "order", f"after {before[1]}", f"before {before[1]}")


def _first_places(exchanges: Sequence[Exchange]) -> dict[tuple[str, str, str], int]:
    found: dict[tuple[str, str, str], int] = {}
    for place, exchange in enumerate(exchanges):
        found.setdefault((exchange.door, exchange.operation, str(exchange.direction)), place)
    return found


def _short(value: object) -> str:
    if value is None or isinstance(value, bool):
        text = json.dumps(value)  # as the message has it
    else:
        text = value.decode("utf-8", "replace") if isinstance(value, bytes) else str(value)
    text = " ".join(filter(None, text.splitlines()))
    return text if len(text) <= VALUE_MAX else text[: VALUE_MAX - 1] + "…"
