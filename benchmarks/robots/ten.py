"""Claim: ten robots in the office that drive, scan at 10 Hz, match every scan and map, one of them filmed: <= 0.5 core.

In real time, with autonomy, without doors. The film is 720p30 in H.264.
"""

from __future__ import annotations

import asyncio
import time

from _claim import Claims

from roboglot.config import RobotConfig
from roboglot.fleet import build_fleet
from roboglot.media.video import VideoStream
from roboglot.model.clock import RealClock
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.storage.database import Database

ROBOTS, SECONDS, LIMIT = 10, 10.0, 0.5
CIRCLE = Twist(0.15, 0.0, 0.6)  # half a metre wide: keep clear of each other


async def main() -> None:
    claims, clock, database = Claims(), RealClock(), Database(":memory:")
    configs = [RobotConfig(f"r{number}") for number in range(ROBOTS)]
    fleet = build_fleet("office", configs, clock=clock, seed=1, database=database)
    await fleet.start(wait=True)
    scans = 0

    def scanned(_: ScanTaken) -> None:
        nonlocal scans
        scans += 1

    for robot in fleet.robots.values():
        robot.events.listen(ScanTaken, scanned)
        robot[Driving].drive(CIRCLE)
    viewer = fleet.robots["r0"][VideoStream].subscribe()
    await asyncio.sleep(3.0)  # kernels of the camera, encoder
    viewer.drain()
    scans, pictures, used, began = 0, 0, time.process_time(), time.monotonic()
    while (passed := time.monotonic() - began) < SECONDS:
        await asyncio.sleep(0.1)
        pictures += len(viewer.drain())
    share = (time.process_time() - used) / passed
    slowest = min(robot[Odometry].reading.distance for robot in fleet.robots.values())
    print(f"everybody drove {slowest:.1f} m or more; ", end="")
    print(f"{scans / passed / ROBOTS:.1f} scans a robot and second, {pictures / passed:.1f} pictures a second")
    claims.at_most("ten robots and a film", share, LIMIT, "core")
    viewer.close()
    await fleet.close()
    database.close()
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
