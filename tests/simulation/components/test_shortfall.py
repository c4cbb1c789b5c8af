"""Log of a camera whose pictures the machine cannot draw."""

from __future__ import annotations

import asyncio
import logging
import os
import threading

import pytest

from roboglot.model.background import NICENESS, beside
from roboglot.simulation.components.sensing.camera import Shortfall


def said(caplog: pytest.LogCaptureFixture, *rates: float) -> list[str]:
    """Take pictures at these rates for 20 s each."""
    shortfall, now = Shortfall("b", 30.0), 0.0
    with caplog.at_level(logging.INFO):
        for rate in rates:
            for _ in range(round(20.0 * rate)):
                now += 1.0 / rate
                shortfall.note(now)
    return [record.getMessage() for record in caplog.records]


def test_all_is_well(caplog: pytest.LogCaptureFixture) -> None:
    assert said(caplog, 30.0, 27.0) == []


def test_stream_that_does_not_fit_is_named_once(caplog: pytest.LogCaptureFixture) -> None:
    (line,) = said(caplog, 30.0, 12.0, 13.0)
    assert "the camera of b takes" in line
    assert "of 30 pictures a second" in line


def test_it_is_said_when_they_fit_again(caplog: pytest.LogCaptureFixture) -> None:
    _, again = said(caplog, 12.0, 30.0)
    assert again.endswith("again")


async def test_threads_beside_the_loop_give_way() -> None:
    def look() -> tuple[int, int]:
        identifier = threading.get_native_id()
        return identifier, os.getpriority(os.PRIO_PROCESS, identifier)

    mine = os.getpriority(os.PRIO_PROCESS, threading.get_native_id())
    (thread, nice), *_ = await asyncio.gather(beside(look), beside(look))
    assert thread != threading.get_native_id()
    assert nice == max(NICENESS, mine)
    assert os.getpriority(os.PRIO_PROCESS, threading.get_native_id()) == mine
