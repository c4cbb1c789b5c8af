"""Due times of conditions: arithmetic on the calendar of one time zone. Reads no clock and waits for nothing."""

from __future__ import annotations

import calendar
from datetime import UTC, date, datetime, time, timedelta, tzinfo
from itertools import product

from roboglot.task_conditions import Cycle, Moment, parse_cycle, parse_moment

DAYS_AHEAD = 9 * 366
"""Every possible day of month and week recurs within this many days (worst: 29 February around the year 2100)."""


def due_of(mode: str, condition: str, now: float, zone: tzinfo) -> float | None:
    """Return a task's next start, Unix s; None: never, or at server start. Raises BadCondition."""
    if mode == "cycle":
        return due_next(parse_cycle(condition), now, zone)
    return due_once(parse_moment(condition), now, zone)


def due_once(moment: Moment, now: float, zone: tzinfo) -> float | None:
    """Return the time of ``moment``, Unix s; None: it is past, or beyond the year 9999.

    A clock time without a date is today's, or tomorrow's if today's is past; an amount is added to that time.
    """
    if moment.immediate:
        return now
    try:
        due = _later(_base(moment, now, zone), moment.amount, moment.unit).timestamp()
    except (OverflowError, ValueError):  # beyond the year 9999
        return None
    return due if due >= now else None


def _base(moment: Moment, now: float, zone: tzinfo) -> datetime:
    """Return the time to which a moment's amount is added."""
    here = datetime.fromtimestamp(now, zone)
    if moment.clock is None:
        return here
    base = datetime.combine(moment.day or here.date(), moment.clock, zone)
    return base + timedelta(days=1) if moment.day is None and base.timestamp() < now else base


def due_next(cycle: Cycle, after: float, zone: tzinfo) -> float | None:
    """Return the first time of ``cycle`` after ``after``, both Unix s; None: never.

    Hours skipped by a change of clocks count as the hour after; repeated hours count once.
    """
    if cycle.at_start:
        return None
    times = [time(hour, minute) for hour, minute in product(sorted(cycle.hours), sorted(cycle.minutes))]
    day = datetime.fromtimestamp(after, zone).date()
    for _ in range(DAYS_AHEAD):
        for moment in times if _day_matches(cycle, day) else ():
            due = datetime.combine(day, moment, zone).timestamp()
            if due > after:
                return due
        if day == date.max:
            return None
        day += timedelta(days=1)
    return None


def _day_matches(cycle: Cycle, day: date) -> bool:
    """Return whether the day matches as in cron: if day and week day are both restricted, one match suffices."""
    if day.month not in cycle.months:
        return False
    by_day, by_weekday = day.day in cycle.days, day.isoweekday() % 7 in cycle.weekdays
    return by_day and by_weekday if cycle.any_day or cycle.any_weekday else by_day or by_weekday


def _later(base: datetime, amount: int, unit: str) -> datetime:
    """Return ``base`` plus ``amount`` units; in months too short for the day, their last day.

    Minutes and hours pass also while clocks change; longer units keep the time of day.
    """
    if amount == 0:
        return base
    if unit in ("minutes", "hours"):
        return (base.astimezone(UTC) + timedelta(**{unit: amount})).astimezone(base.tzinfo)
    if unit in ("days", "weeks"):
        return base + timedelta(**{unit: amount})
    months = base.month - 1 + amount * (12 if unit == "years" else 1)
    year, month = base.year + months // 12, months % 12 + 1
    if year > date.max.year:
        raise OverflowError(f"the year {year}")
    return base.replace(year=year, month=month, day=min(base.day, calendar.monthrange(year, month)[1]), fold=0)
