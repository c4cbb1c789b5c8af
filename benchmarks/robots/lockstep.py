"""Claims: one robot with all its autonomy in lockstep, lidar at 10 Hz: >= 300x real time standing, >= 150x on its way.

The 100x of the physics and sensors alone is in fleet.py. Here every scan is matched as well, people walk,
and on the way (it drives all that time) the robot maps, watches its path and plans. Counted by the processor time of
the process; how fast it went by the clock on the wall, whatever else ran, is only told.
"""

from __future__ import annotations

import asyncio
import time

from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Point
from roboglot.storage.database import Database

SECONDS = 60.0


async def main() -> None:
    claims, clock, database = Claims(), LockstepClock(), Database(":memory:")
    fleet = build_fleet("office", [RobotConfig()], clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    scans: list[float] = []
    robot.events.listen(ScanTaken, lambda event: scans.append(event.stamp))
    await clock.advance(1.0)
    for name, goals, limit in (
        ("still", [], 300.0),
        ("driving", [Point(3, 0), Point(0.5, 0)] * 6, 150.0),
    ):
        if goals:
            robot[Navigation].navigate_to(goals, NavigationOptions())
        scans.clear()
        began, began_working = time.perf_counter(), time.process_time()
        await clock.advance(SECONDS)
        speed, working = SECONDS / (time.perf_counter() - began), SECONDS / (time.process_time() - began_working)
        print(f"{speed:.0f}x by the clock on the wall; by processor time: ", end="")
        claims.at_least(f"{name}, lidar at {len(scans) / SECONDS:.1f} Hz", working, limit, "x real time")
    await fleet.close()
    database.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
