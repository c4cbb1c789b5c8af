"""Due times of conditions, on calendars of several zones."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, tzinfo
from zoneinfo import ZoneInfo

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.clock import LockstepClock
from roboglot.programs.tasks.calendar import due_next, due_of, due_once
from roboglot.programs.tasks.schedule import STALE_MAX, Schedule
from roboglot.task_conditions import BadCondition, parse_cycle, parse_moment

SHANGHAI, BERLIN = ZoneInfo("Asia/Shanghai"), ZoneInfo("Europe/Berlin")


def at(text: str, zone: tzinfo = UTC) -> float:
    return datetime.fromisoformat(text).replace(tzinfo=zone).timestamp()


def shown(due: float | None, zone: tzinfo = UTC) -> str:
    return "never" if due is None else datetime.fromtimestamp(due, zone).strftime("%Y-%m-%d %H:%M")


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("now", "2026-01-31 16:50"),
        ("now + 5minutes", "2026-01-31 16:55"),
        ("now + 0minutes", "2026-01-31 16:50"),
        ("now + 36hours", "2026-02-02 04:50"),
        ("now + 2weeks", "2026-02-14 16:50"),
        ("now + 1months", "2026-02-28 16:50"),  # there is no 31 February
        ("now + 13months", "2027-02-28 16:50"),
        ("now + 10000years", "never"),
        ("16:50", "2026-01-31 16:50"),
        ("16:49", "2026-02-01 16:49"),
        ("21:30", "2026-01-31 21:30"),
        ("16:49 + 5days", "2026-02-06 16:49"),
        ("00:01 2022-12-01", "never"),
        ("00:01 2022-12-01 + 5years", "2027-12-01 00:01"),
        ("00:00 2024-02-29 + 3years", "2027-02-28 00:00"),
        ("23:59 9999-12-31 + 1minutes", "never"),
    ],
)
def test_single_conditions(condition: str, expected: str) -> None:
    assert shown(due_once(parse_moment(condition), at("2026-01-31 16:50"), UTC)) == expected


@pytest.mark.parametrize(
    ("condition", "expected"),
    [
        ("* * * * *", "2026-01-31 16:51"),
        ("*/1 * * * *", "2026-01-31 16:51"),
        ("01 * * * *", "2026-01-31 17:01"),
        ("3,15 8-11 * * *", "2026-02-01 08:03"),
        ("3,15 8-11 */2 * *", "2026-02-01 08:03"),
        ("3,15 8-11 * * 1", "2026-02-02 08:03"),
        ("30 21 * * *", "2026-01-31 21:30"),
        ("45 4 1,10,22 * *", "2026-02-01 04:45"),
        ("0,30 18-23 * * *", "2026-01-31 18:00"),
        ("02 15 * * 1,5,7", "2026-02-01 15:02"),
        ("0 0 * * 0", "2026-02-01 00:00"),
        ("0 0 * * 7", "2026-02-01 00:00"),
        ("0-30/7 3 * * *", "2026-02-01 03:00"),
        ("0 0 29 2 *", "2028-02-29 00:00"),
        ("0 0 30 2 *", "never"),
        ("0 0 13 * 5", "2026-02-06 00:00"),  # the 13th, or a Friday
        ("0 0 */13 * 5", "2026-02-27 00:00"),  # */ counts as "any day": both must match, as cron has it
        ("@reboot", "never"),
    ],
)
def test_cycles(condition: str, expected: str) -> None:
    assert shown(due_next(parse_cycle(condition), at("2026-01-31 16:50"), UTC)) == expected


def test_a_zone_decides_what_its_clocks_show() -> None:
    now = at("2026-01-31 23:00")
    assert shown(due_of("single", "08:00", now, SHANGHAI)) == "2026-02-01 00:00"
    assert shown(due_of("cycle", "0 7 * * *", now, SHANGHAI), SHANGHAI) == "2026-02-02 07:00"
    with pytest.raises(BadCondition):
        due_of("cycle", "now", now, UTC)
    with pytest.raises(BadCondition):
        due_of("single", "* * * * *", now, UTC)


def test_due_times_when_the_clocks_change() -> None:
    skipped = due_of("cycle", "30 2 * * *", at("2026-03-28 12:00"), BERLIN)
    assert shown(skipped, BERLIN) == "2026-03-29 03:30"
    twice = parse_cycle("30 2 * * *")
    first = due_next(twice, at("2026-10-24 12:00"), BERLIN)
    assert first is not None
    assert shown(first, BERLIN) == "2026-10-25 02:30"
    assert shown(due_next(twice, first, BERLIN), BERLIN) == "2026-10-26 02:30"  # once, although 02:30 came twice


@pytest.mark.parametrize(
    ("now", "condition", "expected"),  # UTC; Berlin's 02:00 to 03:00 is skipped on 29 March, repeated on 25 October
    [
        ("2026-03-29 00:30", "now + 2hours", "2026-03-29 02:30"),
        ("2026-03-29 00:30", "now + 1days", "2026-03-29 23:30"),
        ("2026-03-29 01:10", "02:30", "2026-03-29 01:30"),  # it is 03:10: what was skipped counts as the hour after
        ("2026-10-25 00:30", "now + 1hours", "2026-10-25 01:30"),
        ("2026-10-25 01:30", "now + 10minutes", "2026-10-25 01:40"),  # in the second 02:30
        ("2026-10-25 01:30", "02:50", "2026-10-26 01:50"),  # the first 02:50 is past
        ("2026-10-25 00:30", "02:50 + 30minutes", "2026-10-25 01:20"),
    ],
)
def test_moments_while_the_clocks_change(now: str, condition: str, expected: str) -> None:
    assert shown(due_of("single", condition, at(now), BERLIN)) == expected


LIMITS = ((3, 40), (2, 19), (5, 28), (2, 11), (1, 6))
FORMS = ("*", "{0}", "{1}", "{0}-{1}", "*/{1}", "{0},{1}")
FIELDS = st.tuples(*(st.sampled_from([form.format(*pair) for form in FORMS]) for pair in LIMITS))


@given(FIELDS, st.integers(0, 3 * 366 * 24 * 60))
def test_a_cycle_is_what_trying_every_minute_finds(fields: tuple[str, ...], minutes: int) -> None:
    cycle, after = parse_cycle(" ".join(fields)), datetime(2024, 1, 1, tzinfo=UTC) + timedelta(minutes=minutes)
    due = due_next(cycle, after.timestamp(), UTC)
    assert due is not None
    found = datetime.fromtimestamp(due, UTC)
    assert found > after

    def matches(moment: datetime) -> bool:
        day, week = moment.day in cycle.days, moment.isoweekday() % 7 in cycle.weekdays
        both = cycle.any_day or cycle.any_weekday
        return (
            moment.minute in cycle.minutes
            and moment.hour in cycle.hours
            and moment.month in cycle.months
            and (day and week if both else day or week)
        )

    assert matches(found)
    for step in range(1, min(3000, int((found - after).total_seconds() // 60))):
        assert not matches(found - timedelta(minutes=step))


async def test_schedule_fires_once_in_order_forgetting_dropped_entries() -> None:
    clock = LockstepClock()
    fired: list[tuple[str, float]] = []
    schedule = Schedule(clock, lambda id, _due: fired.append((id, clock.time())))
    start = clock.epoch()
    for id, after in (("t1", 20.0), ("t10", 10.0), ("t", 10_000.0), ("moved", 5.0), ("dropped", 1.0), ("past", -50.0)):
        schedule.set(id, start + after)
    schedule.set("moved", start + 30.0)
    schedule.drop("dropped")
    await clock.advance(9999.0)
    assert [(id, round(time, 3)) for id, time in fired] == [("past", 0), ("t10", 10), ("t1", 20), ("moved", 30)]
    await clock.advance(1.0)
    assert fired[-1] == ("t", pytest.approx(10_000.0))
    schedule.set("t", start + 20_000.0)
    schedule.clear()
    await clock.advance(20_000.0)
    assert len(fired) == 5


async def test_schedule_does_not_grow_by_being_set_again() -> None:
    schedule = Schedule(LockstepClock(), lambda _id, _due: None)
    for i in range(1000):
        schedule.set("t", 1e10 + i)
    assert len(schedule._heap) <= STALE_MAX + 3
