"""Processor time of a server compared with that of a reference that does nothing, measured in turns in the same run.

The processor time of the idle robot's world is measured first and subtracted: on a busy machine the same number of
requests takes longer, so the world would otherwise take a larger share.
"""

from __future__ import annotations

import statistics
import time
from collections.abc import Callable

ROUNDS = 5
CPU_CLOCK = 2  # Linux: the scheduler's clock of a process, whose number is in the bits before
QUIET = 4.0  # s without requests


def cpu_seconds(pid: int) -> float:
    """Processor time of a process so far, with ended threads, to the microsecond."""
    return time.clock_gettime((~pid << 3) | CPU_CLOCK)


def idle_share(pid: int) -> float:
    """Processor time per second without requests."""
    before, began = cpu_seconds(pid), time.perf_counter()
    time.sleep(QUIET)
    return (cpu_seconds(pid) - before) / (time.perf_counter() - began)


def per_core_second(pid: int, idle: float, ask: Callable[[], int]) -> float:
    """Requests that ``ask`` counts, per second of the processor time that they took."""
    before, began = cpu_seconds(pid), time.perf_counter()
    count = ask()
    return count / (cpu_seconds(pid) - before - idle * (time.perf_counter() - began))


def in_turns(bare: Callable[[], float], ours: Callable[[], float], rounds: int = ROUNDS) -> tuple[float, float]:
    """Return the median rate of ours and the median share that it is of the bare one's, round by round; prints them."""
    pairs = [(bare(), ours()) for _ in range(rounds)]
    shares = [mine / reference for reference, mine in pairs]
    print(f"  bare {min(b for b, _ in pairs):.0f} to {max(b for b, _ in pairs):.0f} a core second, ours", end=" ")
    print(f"{min(o for _, o in pairs):.0f} to {max(o for _, o in pairs):.0f}; shares", end=" ")
    print(" ".join(f"{share:.2f}" for share in sorted(shares)), flush=True)
    return statistics.median(ours_ for _, ours_ in pairs), statistics.median(shares)
