"""Claims: one robot with all its autonomy in lockstep, lidar at 10 Hz: >= 300x real time standing, >= 150x on its way.

And a scan is matched in <= 0.3 ms on the way (median).

The 100x of the physics and sensors alone is in fleet.py. Here every scan is matched as well, people walk,
and on the way (it drives all that time) the robot maps, watches its path and plans. Counted by the processor time of
the process, in windows. A loop of plain Python, timed in between, shows how much the machine's speed changes meanwhile;
wall-clock speed, which other load changes, is only printed.
"""

from __future__ import annotations

import asyncio
import gc
import statistics
import time
from collections.abc import Callable

from _claim import Claims

from roboglot.autonomy.slam import slam
from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point
from roboglot.storage.database import Database

SECONDS, WINDOWS = 60.0, 12
FIRST = 5.0  # s before the windows: what is made at its first use
Fit = Callable[..., object]


def reference() -> float:
    """Processor time of a million turns of a loop, s."""
    began, number = time.process_time(), 0
    for turn in range(1_000_000):
        number += turn * turn % 7
    return time.process_time() - began


def timed(fit: Fit, spent: list[float]) -> Fit:
    """Return ``fit`` that notes the processor time of each call, s."""

    def fitted(*values: object, **options: object) -> object:
        began = time.thread_time()
        try:
            return fit(*values, **options)
        finally:
            spent.append(time.thread_time() - began)

    return fitted


async def measure(clock: LockstepClock) -> float:
    """Robot seconds per second of processor time; prints how evenly."""
    spent, loops, began = list[float](), [reference()], time.perf_counter()
    for _ in range(WINDOWS):
        before = time.process_time()
        await clock.advance(SECONDS / WINDOWS)
        spent.append(time.process_time() - before)
        loops.append(reference())
    wall = time.perf_counter() - began - sum(loops[1:])
    speeds = [SECONDS / WINDOWS / seconds for seconds in spent]
    print(
        f"windows {min(speeds):.0f} to {max(speeds):.0f} x, {SECONDS / wall:.0f} x by the clock on the wall; a million"
    )
    print(f"turns of a loop took {min(loops) * 1e3:.0f} to {max(loops) * 1e3:.0f} ms")
    return SECONDS / sum(spent)


async def main() -> None:
    claims, clock, database = Claims(), LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig()], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    scans, matches = list[float](), list[float]()
    setattr(slam, "fit", timed(slam.fit, matches))  # noqa: B010 - a function of the module, for this run
    robot.events.listen(ScanTaken, lambda event: scans.append(event.stamp))
    await clock.advance(FIRST)
    gc.freeze()  # as the runtime does
    for name, goals, limit in (
        ("still", [], 300.0),
        ("driving", [Point(3, 0), Point(0.5, 0)] * 6, 150.0),
    ):
        if goals:
            robot[Navigation].navigate_to(goals, NavigationOptions())
            await clock.advance(FIRST)
        scans.clear()
        matches.clear()
        speed = await measure(clock)
        claims.at_least(f"{name}, lidar at {len(scans) / SECONDS:.1f} Hz", speed, limit, "x real time")
    claims.at_most("matching a scan on the way, median", statistics.median(matches) * 1e3, 0.3, "ms")
    await fleet.close()
    database.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
