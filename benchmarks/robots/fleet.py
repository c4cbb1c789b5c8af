"""Claim: 100 universal robots that drive in the office at >= 8x real time on one core, lidar at 10 Hz; 10 at >= 90x.

Counts processor time of this one thread, without autonomy; lockstep.py measures one robot with it. All
drive circles all the time; how far the slowest came is printed. A loop of plain Python, timed in between, shows how
much the machine's speed changes meanwhile: by a half where another thread uses the same core.
"""

from __future__ import annotations

import asyncio
import os
import statistics
import time

from _claim import Claims
from _driving import crowd

WINDOWS = 9


def reference() -> float:
    """Processor time of a million turns of a loop, s."""
    began, number = time.thread_time(), 0
    for turn in range(1_000_000):
        number += turn * turn % 7
    return time.thread_time() - began


async def measure(count: int, body: str, seconds: float, *, driving: bool) -> tuple[float, float]:
    """Robot seconds per second of one core, the median of some windows, and scans per robot and second."""
    robots = await crowd(count, body, 1, driving=driving)
    began_at, speeds, loops = robots.ways, [], [reference()]
    for _ in range(WINDOWS):
        began = time.thread_time()
        await robots.clock.advance(seconds / WINDOWS)
        speeds.append(seconds / WINDOWS / (time.thread_time() - began))
        loops.append(reference())
    robots.world.close()
    ways = [way - before for way, before in zip(robots.ways, began_at, strict=True)]
    print(f"windows {min(speeds):.1f} to {max(speeds):.1f} x, the slowest drove {min(ways):.1f} m", end="; ")
    print(f"a million turns of a loop took {min(loops) * 1e3:.0f} to {max(loops) * 1e3:.0f} ms")
    return statistics.median(speeds), robots.scans / count / seconds


async def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    claims = Claims()
    for count, body, seconds, driving, claim in (
        (1, "universal", 30.0, False, 100.0),
        (1, "universal", 30.0, True, 100.0),
        (1, "hermes", 30.0, True, 100.0),
        (10, "universal", 10.0, True, 90.0),
        (100, "universal", 5.0, False, 8.0),
        (100, "universal", 5.0, True, 8.0),
    ):
        speed, rate = await measure(count, body, seconds, driving=driving)
        what = f"{count} x {body}, {'driving' if driving else 'still'}"
        claims.at_least(f"{what}, {rate:.1f} Hz", speed, claim, "x real time")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
