"""Claim: 1,000 robots that drive, with lidar at 10 Hz, at >= 1 x real time on two cores: ten worlds of a hundred.

Ten processes are forked from one that has loaded everything. Physics and sensors, without autonomy and doors, as in
fleet.py. What counts is processor time: how fast two cores that do nothing else would be. The clock on the
wall is printed beside it, with what the machine was busy with.

    scripts/bench thousand [--worlds 10] [--robots-each 100] [--seconds 10]
"""

from __future__ import annotations

import argparse
import asyncio
import gc
import os
import time

from _claim import Claims

from roboglot.kernels import loading
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

CORES = 2
AHEAD, CIRCLE = Twist(0.15, 0.0, 0.0), Twist(0.12, 0.0, 1.0)  # off docks, then round where there is room
READY = b"r"


async def shard(number: int, count: int, seconds: float, ready: int, go: int) -> tuple[float, int, float]:
    """One world, driven: its processor time (s), its scans, and how far the slowest robot drove (m)."""
    clock = LockstepClock()
    names = [f"r{index}" for index in range(count)]
    world = World(load_world("office"), [RobotPlacement(name) for name in names], clock=clock, seed=number)
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
    for twist in (AHEAD, CIRCLE):
        for robot in robots:
            robot[Base].set_velocity(twist)
        await clock.advance(1.0)
    scans, began = 0, [robot[Odometry].reading.distance for robot in robots]
    os.write(ready, READY)
    os.read(go, 1)  # all begin together
    used = time.process_time()
    await clock.advance(seconds)
    used = time.process_time() - used
    world.close()
    ways = [robot[Odometry].reading.distance - before for robot, before in zip(robots, began, strict=True)]
    return used, scans, min(ways)


def become_shard(number: int, count: int, seconds: float, ends: tuple[int, int, int]) -> None:
    """In the child; never returns."""
    ready, go, answer = ends
    try:
        used, scans, way = asyncio.run(shard(number, count, seconds, ready, go))
        os.write(answer, f"{used} {scans} {way}\n".encode())
    finally:
        os._exit(0)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=10)
    parser.add_argument("--robots-each", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=10.0)
    chosen, claims = parser.parse_args(), Claims()
    with loading():
        import mujoco  # noqa: F401 - loaded once, for all

        import roboglot.kernels.sweep  # noqa: F401
    (ready, is_ready), (go, starts), (answers, answer) = os.pipe(), os.pipe(), os.pipe()
    for number in range(chosen.worlds):
        if os.fork() == 0:
            become_shard(number + 1, chosen.robots_each, chosen.seconds, (is_ready, go, answer))
    for _ in range(chosen.worlds):
        os.read(ready, 1)
    began = time.monotonic()
    os.write(starts, READY * chosen.worlds)
    os.close(answer)
    with os.fdopen(answers) as lines:
        outcomes = [tuple(map(float, line.split())) for line in lines]
    passed = time.monotonic() - began
    robots = chosen.worlds * chosen.robots_each
    used = sum(outcome[0] for outcome in outcomes)
    rate = sum(outcome[1] for outcome in outcomes) / robots / chosen.seconds
    print(
        f"{robots} robots, {rate:.1f} scans a robot and second, the slowest drove {min(o[2] for o in outcomes):.2f} m"
    )
    others = max(0.0, 1.0 - used / (passed * (os.cpu_count() or 1)))
    print(f"by the clock on the wall {chosen.seconds / passed:.2f} x, others had {others:.0%} of the machine")
    claims.at_least(f"{robots} driving, on {CORES} cores", CORES * chosen.seconds / used, 1.0, "x real time")
    claims.finish()


if __name__ == "__main__":
    main()
