"""Meaning of the manual's conditions, and refusals of what is none."""

from __future__ import annotations

from datetime import date, time

import pytest

from roboglot.task_conditions import (
    BadCondition,
    Cycle,
    Interface,
    Moment,
    parse_cycle,
    parse_interface,
    parse_moment,
)


@pytest.mark.parametrize(
    ("text", "moment"),
    [
        ("now", Moment()),
        ("now + 0minutes", Moment()),
        ("16:50", Moment(time(16, 50))),
        ("00:01 2022-12-01", Moment(time(0, 1), date(2022, 12, 1))),
        ("now + 5minutes", Moment(amount=5)),
        ("now+5minutes", Moment(amount=5)),
        ("now + 5 minutes", Moment(amount=5)),
        ("16:50 + 5days", Moment(time(16, 50), amount=5, unit="days")),
        ("00:01 2022-12-01 + 5years", Moment(time(0, 1), date(2022, 12, 1), 5, "years")),
    ],
)
def test_a_single_task_runs_once(text: str, moment: Moment) -> None:
    assert parse_moment(text) == moment


def test_only_now_is_now() -> None:
    assert parse_moment("now + 0hours").immediate
    assert not parse_moment("now + 1hours").immediate
    assert not parse_moment("00:00").immediate


@pytest.mark.parametrize(
    "text",
    [
        *("", "now + 1minute", "now + 5seconds", "24:00", "12:60", "16:50 2022-13-01", "16:50 2022-02-30", "@reboot"),
        *("* * * * *", "now; reboot", "now\n-f x", "１2:00", "now + 99999days", "now" + " " * 300),
    ],
)
def test_invalid_moments_are_refused(text: str) -> None:
    with pytest.raises(BadCondition):
        parse_moment(text)


@pytest.mark.parametrize(
    ("text", "minutes", "hours"),
    [
        ("*/1 * * * *", set(range(60)), set(range(24))),
        ("01 * * * *", {1}, set(range(24))),
        ("3,15 8-11 * * *", {3, 15}, {8, 9, 10, 11}),
        ("3，15 8-11 * * *", {3, 15}, {8, 9, 10, 11}),
        ("0-30/10 */6 * * *", {0, 10, 20, 30}, {0, 6, 12, 18}),
        ("1-5,10 7 * * *", {1, 2, 3, 4, 5, 10}, {7}),
        ("50/5 7 * * *", {50, 55}, {7}),
    ],
)
def test_a_cycle_task_runs_by_the_clock(text: str, minutes: set[int], hours: set[int]) -> None:
    cycle = parse_cycle(text)
    assert (cycle.minutes, cycle.hours) == (minutes, hours)


def test_sunday_is_0_and_7() -> None:
    assert parse_cycle("0 0 * * 0").weekdays == parse_cycle("0 0 * * 7").weekdays == {0}
    assert parse_cycle("02 15 * * 1,5,7").weekdays == {0, 1, 5}


def test_restricted_days_are_distinguished_from_free_ones() -> None:
    assert parse_cycle("45 4 1,10,22 * *").any_day is False
    assert parse_cycle("45 4 1,10,22 * *").any_weekday is True
    assert parse_cycle("@reboot") == Cycle(at_start=True)


@pytest.mark.parametrize(
    "text",
    [
        *("", "now", "60 * * * *", "0 24 * * *", "* * 0 * *", "* * * 13 *", "* * * * 8", "*/0 * * * *", "5-1 * * * *"),
        *("* * * *", "* * * jan *", "* * * * * *", "-1 * * * *", "1,,2 * * * *", "1- * * * *"),
    ],
)
def test_invalid_cycles_are_refused(text: str) -> None:
    with pytest.raises(BadCondition):
        parse_cycle(text)


@pytest.mark.parametrize(
    ("text", "interface"),
    [
        ("foo()", Interface("foo", ())),
        ("f(a)", Interface("f", ("a",))),
        ("usr_behavior_hunger_1(name, size)", Interface("usr_behavior_hunger_1", ("name", "size"))),
        ("问候( 名字 )", Interface("问候", ("名字",))),
    ],
)
def test_a_module_is_called_by_its_interface(text: str, interface: Interface) -> None:
    assert parse_interface(text) == interface


@pytest.mark.parametrize(
    "text",
    ["2foo()", "foo(a=1)", "foo(,ab)", "foo(ab,)", "foo", "def()", "foo(a, a)", "foo(*a)", "foo(a b)", "foo()\nx()"],
)
def test_invalid_interfaces_are_refused(text: str) -> None:
    with pytest.raises(BadCondition):
        parse_interface(text)
