"""Scans are matched in turn, each before the next one comes."""

from __future__ import annotations

import asyncio

import numpy as np

from roboglot.autonomy.slam.turns import Turns
from roboglot.model.clock import LockstepClock, RealClock
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import ORIGIN
from roboglot.model.sensing import LaserScan


def scan(stamp: float) -> ScanTaken:
    ranges = np.ones(4, np.float32)
    return ScanTaken(stamp=stamp, scan=LaserScan(stamp, ranges, 0.0, 1.0, 0.1, 9.0, mount=ORIGIN), odometry=ORIGIN)


async def test_no_scan_that_waits_is_lost() -> None:
    clock, taken = RealClock(), list[float]()
    turns = Turns(clock, lambda event: taken.append(event.stamp))
    turns.hear(scan(1.0))
    assert taken == []
    turns.hear(scan(2.0))
    turns.hear(scan(3.0))
    assert taken == [1.0, 2.0]  # turns are late: pending scans are taken before the next one
    await asyncio.sleep(0)
    assert taken == [1.0, 2.0, 3.0]
    turns.hear(scan(4.0))
    turns.close()
    await asyncio.sleep(0)
    assert taken == [1.0, 2.0, 3.0]


async def test_scans_are_taken_at_once_in_lockstep() -> None:
    taken = list[float]()
    Turns(LockstepClock(), lambda event: taken.append(event.stamp)).hear(scan(1.0))
    assert taken == [1.0]
