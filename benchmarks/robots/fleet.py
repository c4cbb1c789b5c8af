"""Claim: 100 universal robots that drive in the office at >= 8x real time on one core, lidar at 10 Hz; 10 at >= 90x.

Counts processor time of this one thread, without autonomy; lockstep.py measures one robot with it. All
drive circles all the time; how far the slowest came is printed. A loop of plain Python, timed in between, shows how
much the machine's speed changes meanwhile: by a half where another thread uses the same core.
"""

from __future__ import annotations

import asyncio
import gc
import os
import statistics
import time

from _claim import Claims

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

WINDOWS = 9
AHEAD, CIRCLE = Twist(0.15, 0.0, 0.0), Twist(0.12, 0.0, 1.0)  # off docks, then round where there is room


def reference() -> float:
    """Processor time of a million turns of a loop, s."""
    began, number = time.thread_time(), 0
    for turn in range(1_000_000):
        number += turn * turn % 7
    return time.thread_time() - began


async def measure(count: int, body: str, seconds: float, *, driving: bool) -> tuple[float, float]:
    """Robot seconds per second of one core, the median of some windows, and scans per robot and second."""
    clock = LockstepClock()
    names = [f"r{index}" for index in range(count)]
    world = World(load_world("office"), [RobotPlacement(name, body) for name in names], clock=clock, seed=1)
    scans = 0

    def scanned(_: ScanTaken) -> None:
        nonlocal scans
        scans += 1

    robots = [Robot(name, world.description_of(name), clock) for name in names]
    for robot in robots:
        world.equip(robot)
        robot.events.listen(ScanTaken, scanned)
    await world.prepare(wait=True)
    world.start()
    await clock.advance(0.5)
    gc.freeze()  # as the runtime does
    for twist in (AHEAD, CIRCLE) if driving else ():
        for robot in robots:
            robot[Base].set_velocity(twist)
        await clock.advance(1.0)
    scans, speeds, loops = 0, [], [reference()]
    began_at = [robot[Odometry].reading.distance for robot in robots]
    for _ in range(WINDOWS):
        began = time.thread_time()
        await clock.advance(seconds / WINDOWS)
        speeds.append(seconds / WINDOWS / (time.thread_time() - began))
        loops.append(reference())
    world.close()
    ways = [robot[Odometry].reading.distance - before for robot, before in zip(robots, began_at, strict=True)]
    print(f"windows {min(speeds):.1f} to {max(speeds):.1f} x, the slowest drove {min(ways):.1f} m", end="; ")
    print(f"a million turns of a loop took {min(loops) * 1e3:.0f} to {max(loops) * 1e3:.0f} ms")
    return statistics.median(speeds), scans / count / seconds


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
