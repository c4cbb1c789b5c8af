"""Log of a machine that is too slow."""

from __future__ import annotations

import logging

import pytest

from roboglot.simulation.world.timing import CALM, WINDOW, Pace


def run(pace: Pace, *losses: float) -> None:
    """Let windows pass in each of which so many seconds are lost."""
    for number in range(len(losses) + 1):
        lost = sum(losses[:number])
        pace.look(number * WINDOW - lost, lost)


def said(caplog: pytest.LogCaptureFixture, *losses: float, speed: float = 1.0, skips: bool = False) -> list[str]:
    with caplog.at_level(logging.INFO):
        run(Pace(lambda: speed, skips=skips), *losses)
    return [record.getMessage() for record in caplog.records]


def test_factor_and_lost_time_are_reported(caplog: pytest.LogCaptureFixture) -> None:
    (line,) = said(caplog, 0, 2.0, speed=4.0)
    assert "real-time factor 2.40 of 4, robot time fell behind by 2.0 s just now" in line
    caplog.clear()
    (line,) = said(caplog, 0, 2.0, speed=4.0, skips=True)
    assert "real-time factor 2.40 of 4, 2.0 s of robot time skipped just now" in line


def test_the_same_pace_is_reported_once(caplog: pytest.LogCaptureFixture) -> None:
    assert len(said(caplog, 2.0, 2.2, 1.8, 2.0)) == 1


def test_worse_is_reported_again(caplog: pytest.LogCaptureFixture) -> None:
    first, second = said(caplog, 1.0, 3.0)
    assert "too slow" in first
    assert "still slower: real-time factor 0.40 of 1, robot time fell behind by 3.0 s just now, 4.0 s in all" in second


def test_the_end_is_reported_once_it_lasts(caplog: pytest.LogCaptureFixture) -> None:
    assert len(said(caplog, 2.0, *[0.0] * (CALM - 1))) == 1
    caplog.clear()
    _, over, again = said(caplog, 2.0, *[0.0] * (CALM + 3), 2.0)
    assert "keeps up again" in over
    assert "robot time fell behind by 2.0 s in all" in over
    assert "too slow for the world" in again


def test_a_fast_machine_says_nothing(caplog: pytest.LogCaptureFixture) -> None:
    assert said(caplog, *[0.0] * 10, 0.2) == []  # a hiccup is no news
