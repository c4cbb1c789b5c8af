"""Claim: one robot in lockstep runs >= 50x real time with its lidar at 10 Hz, while it drives and maps.

It drives all the time that counts as driving. Processor time is told too: that of this process, whatever else runs.
"""

from __future__ import annotations

import asyncio
import time

from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.navigation import Navigation, NavigationOptions
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point
from roboglot.storage.database import Database

SECONDS = 60.0
LIMIT = 50.0


async def main() -> None:
    claims, clock, database = Claims(), LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig()], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    scans: list[float] = []
    robot.events.listen(ScanTaken, lambda event: scans.append(event.stamp))
    await clock.advance(1.0)
    for name, goals in (
        ("still", []),
        ("driving", [Point(3, 0), Point(0.5, 0)] * 6),
    ):
        if goals:
            robot[Navigation].navigate_to(goals, NavigationOptions())
        scans.clear()
        began, began_working = time.perf_counter(), time.process_time()
        await clock.advance(SECONDS)
        speed, working = SECONDS / (time.perf_counter() - began), SECONDS / (time.process_time() - began_working)
        claims.at_least(f"{name}, lidar at {len(scans) / SECONDS:.1f} Hz", speed, LIMIT, "x real time")
        claims.at_least(f"{name}, by processor time", working, LIMIT, "x real time")
    await fleet.close()
    database.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
