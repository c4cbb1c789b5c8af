"""Claim: 100 universal robots in the office at >= 4x real time on one core, lidar at 10 Hz; one robot at >= 100x.

Counts processor time of this one thread, without autonomy; benchmarks/lockstep.py measures one robot with it.
"""

from __future__ import annotations

import asyncio
import os
import time

from _claim import Claims

from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

WINDOWS = 5


async def measure(count: int, body: str, seconds: float, *, driving: bool) -> tuple[float, float]:
    """Robot seconds per second of one core, and scans per robot and second."""
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
    if driving:
        for robot in robots:
            robot[Base].set_velocity(Twist(0.3, 0.0, 0.4))
    scans, fastest = 0, 0.0
    for _ in range(WINDOWS):  # what else the machine does can only slow one down: the best window counts
        began = time.thread_time()
        await clock.advance(seconds / WINDOWS)
        fastest = max(fastest, seconds / WINDOWS / (time.thread_time() - began))
    world.close()
    return fastest, scans / count / seconds


async def main() -> None:
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    claims = Claims()
    for count, body, seconds, driving, claim in (
        (1, "universal", 30.0, False, 100.0),
        (1, "universal", 30.0, True, 100.0),
        (1, "hermes", 30.0, True, 100.0),
        (10, "universal", 10.0, True, 40.0),
        (100, "universal", 5.0, False, 4.0),
        (100, "universal", 5.0, True, 4.0),
    ):
        speed, rate = await measure(count, body, seconds, driving=driving)
        what = f"{count} x {body}, {'driving' if driving else 'still'}"
        claims.at_least(f"{what}, {rate:.1f} Hz", speed, claim, "x real time")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
