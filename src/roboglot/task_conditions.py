"""Grammar of a program's condition: times of a task ("now", "08:30", cron's five fields), signature of a module.

Parses texts, for programs and for their frames; computes no times and knows no clock.
"""

from __future__ import annotations

import keyword
import re
from datetime import date, time

from roboglot.values import dataclass

AMOUNT_MAX = 10_000  # of units in "now + 5minutes"
CONDITION_MAX = 256  # characters

_SINGLE = re.compile(
    r"(?:(?P<now>now)|(?P<hour>\d{1,2}):(?P<minute>\d{2})(?:\s+(?P<date>\d{4}-\d{1,2}-\d{1,2}))?)"
    r"(?:\s*\+\s*(?P<amount>\d{1,5})\s*(?P<unit>minutes|hours|days|weeks|months|years))?",
    re.ASCII,
)
_ITEM = re.compile(r"(?:\*|(?P<first>\d{1,2})(?:-(?P<last>\d{1,2}))?)(?:/(?P<step>\d{1,2}))?", re.ASCII)
_INTERFACE = re.compile(r"\s*(\w+)\s*\(\s*([\w\s,]*?)\s*\)\s*")
_FIELDS = ((0, 59), (0, 23), (1, 31), (1, 12), (0, 7))  # minute, hour, day, month, week day (0 and 7: Sunday)


class BadCondition(ValueError):
    """The text does not fit the grammar; the message says why."""


@dataclass(frozen=True, slots=True)
class Moment:
    """Once: now, at a clock time (today or tomorrow), or on a date; then ``amount`` times ``unit`` later."""

    clock: time | None = None  # None: now
    day: date | None = None
    amount: int = 0
    unit: str = "minutes"

    @property
    def immediate(self) -> bool:
        """Return whether the moment is the present one."""
        return self.clock is None and self.amount == 0


@dataclass(frozen=True, slots=True)
class Cycle:
    """Repeatedly: the allowed values per field (Sunday is 0), or at every start of the engine.

    ``any_day`` and ``any_weekday``: the field is "*"; if both are restricted, either may match, as in cron.
    """

    minutes: frozenset[int] = frozenset()
    hours: frozenset[int] = frozenset()
    days: frozenset[int] = frozenset()
    months: frozenset[int] = frozenset()
    weekdays: frozenset[int] = frozenset()
    any_day: bool = True
    any_weekday: bool = True
    at_start: bool = False


@dataclass(frozen=True, slots=True)
class Interface:
    """Interface of a module."""

    name: str
    parameters: tuple[str, ...]


def parse_moment(text: str) -> Moment:
    """Parse a ``single`` task's condition: "now", "HH:MM", "HH:MM YYYY-MM-DD", each with an optional "+ N<unit>"."""
    match = _SINGLE.fullmatch(_bounded(text).strip())
    if match is None:
        raise BadCondition(
            'a single task runs at "now", "HH:MM" or "HH:MM YYYY-MM-DD", optionally "+ 5minutes" or similar'
        )
    amount = int(match["amount"] or 0)
    if amount > AMOUNT_MAX:
        raise BadCondition(f"{amount} {match['unit']} are too many")
    try:
        clock = None if match["now"] else time(int(match["hour"]), int(match["minute"]))
        day = date(*map(int, match["date"].split("-"))) if match["date"] else None
    except ValueError as error:
        raise BadCondition(str(error)) from None
    return Moment(clock, day, amount, match["unit"] or "minutes")


def parse_cycle(text: str) -> Cycle:
    """Parse a ``cycle`` task's condition: "minute hour day month week" as in cron, or "@reboot"."""
    fields = _bounded(text).replace("，", ",").split()
    if fields == ["@reboot"]:
        return Cycle(at_start=True)
    if len(fields) != len(_FIELDS):
        raise BadCondition('a cycle task runs at "minute hour day month week" or "@reboot"')
    minutes, hours, days, months, weekdays = (
        _values(field, low, high) for field, (low, high) in zip(fields, _FIELDS, strict=True)
    )
    return Cycle(
        minutes,
        hours,
        days,
        months,
        frozenset(day % 7 for day in weekdays),
        any_day=fields[2].startswith("*"),
        any_weekday=fields[4].startswith("*"),
    )


def parse_interface(text: str) -> Interface:
    """Parse a module's interface: "name(parameter, …)"; no defaults, no stars."""
    match = _INTERFACE.fullmatch(_bounded(text))
    if match is None:
        raise BadCondition('a module is declared as "name(parameter, parameter)"')
    parameters = tuple(part.strip() for part in match[2].split(",")) if match[2] else ()
    for name in (match[1], *parameters):
        if not name.isidentifier() or keyword.iskeyword(name):
            raise BadCondition(f"{name!r} is not a name")
    if len(set(parameters)) != len(parameters):
        raise BadCondition("a parameter is named twice")
    return Interface(match[1], parameters)


def _values(field: str, low: int, high: int) -> frozenset[int]:
    values: set[int] = set()
    for item in field.split(","):
        match = _ITEM.fullmatch(item)
        if match is None:
            raise BadCondition(f"{item!r} is not a value, range or step")
        first = int(match["first"] or low)
        last = int(match["last"] or (high if match["first"] is None or match["step"] else first))
        step = int(match["step"] or 1)
        if not low <= first <= last <= high or step == 0:
            raise BadCondition(f"{item!r} is outside of {low} to {high}")
        values.update(range(first, last + 1, step))
    return frozenset(values)


def _bounded(text: str) -> str:
    if len(text) > CONDITION_MAX:
        raise BadCondition(f"longer than {CONDITION_MAX} characters")
    return text
