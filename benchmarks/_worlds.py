"""Worlds full of robots that drive at the same time, each in a process of its own, forked from one that is warm.

With ``turns``, so many of them at once advance by ``TURN`` of robot time while the others wait. Left to the system,
more worlds than cores lose each other's caches at every switch of processes, a hundred times a second: 1.1 ms each.
"""

from __future__ import annotations

import asyncio
import gc
import os
import time
from dataclasses import dataclass
from typing import NamedTuple

from roboglot.kernels import loading
from roboglot.model.clock import LockstepClock
from roboglot.model.components.motion.base import Base
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import ScanTaken
from roboglot.model.geometry import Twist
from roboglot.model.robot import Robot
from roboglot.simulation.world.world import RobotPlacement, World
from roboglot.simulation.world.world_files import load_world

AHEAD, CIRCLE = Twist(0.15, 0.0, 0.0), Twist(0.12, 0.0, 1.0)  # off docks, then round where there is room
READY = b"r"
TURN = 0.1  # s of robot time: a scan of the lidars


@dataclass(frozen=True)
class Drive:
    """How worlds drove at the same time: processor time of each, s; scans of all; the shortest way, m; real s."""

    used: list[float]
    scans: int
    way: float
    passed: float


class Ends(NamedTuple):
    """A child's ends of the pipes: it says that it is ready, waits for the start and for turns, answers."""

    ready: int
    go: int
    answer: int
    take: int
    give: int


async def shard(number: int, count: int, seconds: float, ends: Ends) -> tuple[float, int, float]:
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
    os.write(ends.ready, READY)
    os.read(ends.go, 1)  # all begin together
    used = time.process_time()
    for _ in range(round(seconds / TURN)):
        turn = os.read(ends.take, 1)
        await clock.advance(TURN)
        os.write(ends.give, turn)
    used = time.process_time() - used
    world.close()
    ways = [robot[Odometry].reading.distance - before for robot, before in zip(robots, began, strict=True)]
    return used, scans, min(ways)


def become_shard(number: int, count: int, seconds: float, ends: Ends) -> None:
    """In the child; never returns."""
    try:
        used, scans, way = asyncio.run(shard(number, count, seconds, ends))
        os.write(ends.answer, f"{used} {scans} {way}\n".encode())
    finally:
        os._exit(0)


def warm() -> None:
    """Load what every world needs, once for all."""
    with loading():
        import mujoco  # noqa: F401

        import roboglot.kernels.sweep  # noqa: F401


def drive(worlds: int, each: int, seconds: float, turns: int = 0) -> Drive:
    """Drive ``worlds`` with ``each`` robots for robot ``seconds``: all at once, or ``turns`` of them at a time."""
    (ready, is_ready), (go, starts), (answers, answer), (take, give) = (os.pipe() for _ in range(4))
    for number in range(worlds):
        if os.fork() == 0:
            become_shard(number + 1, each, seconds, Ends(is_ready, go, answer, take, give))
    for _ in range(worlds):
        os.read(ready, 1)
    began = time.monotonic()
    os.write(give, READY * (turns or worlds))
    os.write(starts, READY * worlds)
    os.close(answer)
    with os.fdopen(answers) as lines:
        outcomes = [tuple(map(float, line.split())) for line in lines]
    passed = time.monotonic() - began
    for end in (ready, is_ready, go, starts, take, give):
        os.close(end)
    for _ in range(worlds):
        os.wait()
    used, scans, ways = zip(*outcomes, strict=True)
    return Drive(list(used), int(sum(scans)), min(ways), passed)


def loops(count: int, turns: int = 10_000_000) -> float:
    """Processor time that a loop of plain Python takes while so many run at the same time, s: the mean."""
    (go, starts), (answers, answer) = os.pipe(), os.pipe()
    for _ in range(count):
        if os.fork() == 0:
            os.read(go, 1)
            began, number = time.process_time(), 0
            for turn in range(turns):
                number += turn * turn % 7
            os.write(answer, f"{time.process_time() - began}\n".encode())
            os._exit(0)
    os.write(starts, READY * count)
    os.close(answer)
    with os.fdopen(answers) as lines:
        taken = [float(line) for line in lines]
    for end in (go, starts):
        os.close(end)
    for _ in range(count):
        os.wait()
    return sum(taken) / len(taken)
