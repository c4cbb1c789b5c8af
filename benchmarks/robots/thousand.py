"""Claim: 1,000 robots that drive, with lidar at 10 Hz, at >= 1 x real time on two cores: ten worlds of a hundred.

Ten processes are forked from one that has loaded everything. Physics and sensors, without autonomy and doors, as in
fleet.py; two worlds at a time, in turns of 0.1 s of robot time. What counts is processor time: how fast two cores that
do nothing else would be. The clock on the wall is printed beside it, with what the machine was busy with. References:
one such world alone, all without turns, and a loop of plain Python alone and on both cores.

    scripts/bench thousand [--worlds 10] [--robots-each 100] [--seconds 10]
"""

from __future__ import annotations

import argparse
import os

from _claim import Claims
from _worlds import drive, loops, warm

CORES = 2


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--worlds", type=int, default=10)
    parser.add_argument("--robots-each", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=10.0)
    chosen, claims = parser.parse_args(), Claims()
    warm()
    alone = drive(1, chosen.robots_each, chosen.seconds / 2).used[0] / (chosen.seconds / 2)
    bare = loops(1) / loops(CORES)
    left = drive(chosen.worlds, chosen.robots_each, chosen.seconds / 2)
    every = drive(chosen.worlds, chosen.robots_each, chosen.seconds, CORES)
    robots, used = chosen.worlds * chosen.robots_each, sum(every.used)
    rate = every.scans / robots / chosen.seconds
    print(f"{robots} robots, {rate:.1f} scans a robot and second, the slowest drove {every.way:.2f} m")
    others = max(0.0, 1.0 - used / (every.passed * (os.cpu_count() or 1)))
    print(f"by the clock on the wall {chosen.seconds / every.passed:.2f} x, others had {others:.0%} of the machine")
    slower = used / chosen.worlds / chosen.seconds / alone
    print(f"reference: one world alone {1 / alone:.1f} x; with all others a world takes {slower:.2f} times as much")
    unled = CORES * chosen.seconds / 2 / sum(left.used)
    print(f"reference: all at once, without turns, they go at {unled:.2f} x real time")
    print(f"reference: a loop of plain Python goes at {bare:.2f} of its speed while the other core runs one, too")
    claims.at_least(f"{robots} driving, on {CORES} cores", CORES * chosen.seconds / used, 1.0, "x real time")
    claims.finish()


if __name__ == "__main__":
    main()
