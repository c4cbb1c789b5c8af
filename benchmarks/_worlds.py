"""Worlds full of robots that drive at the same time, each in a separate process, forked from a warm one.

With ``turns``, that many worlds at once advance by ``TURN`` of robot time while the others wait. Scheduled by the
system, more worlds than cores would evict each other's data from the caches at every switch of processes, a hundred
times a second, which costs 1.1 ms each time.
"""

from __future__ import annotations

import asyncio
import os
import time
from dataclasses import dataclass
from typing import NamedTuple

from _driving import crowd

from roboglot.kernels import loading

READY = b"r"
TURN = 0.1  # s of robot time: a scan of the lidars


@dataclass(frozen=True)
class Drive:
    """Result of worlds driven in parallel: processor time of each, s; scans of all; the shortest way, m; real s."""

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
    """Drive one world; return its processor time (s), its scans, and how far the slowest robot drove (m)."""
    robots = await crowd(count, "universal", number, driving=True)
    began = robots.ways
    os.write(ends.ready, READY)
    os.read(ends.go, 1)  # start together
    used = time.process_time()
    for _ in range(round(seconds / TURN)):
        turn = os.read(ends.take, 1)
        await robots.clock.advance(TURN)
        os.write(ends.give, turn)
    used = time.process_time() - used
    robots.world.close()
    return used, robots.scans, min(way - before for way, before in zip(robots.ways, began, strict=True))


def become_shard(number: int, count: int, seconds: float, ends: Ends) -> None:
    """Run the child; never returns."""
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
