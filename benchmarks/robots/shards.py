"""Claim: two shards do >= 1.9 times what one does; 1, 2, 4, 8 of them, as far as two cores hold them.

A shard is a process with one world of 100 robots that drive, as in thousand.py. What counts is processor time, so that
a busy machine changes little: what a core does for one shard alone, and while the other core has one, too. A loop of
plain Python, alone and twice at once, is the reference: where two "cores" share one, no two programs do twice as much.

    scripts/bench shards [--robots-each 100] [--seconds 5]
"""

from __future__ import annotations

import argparse
import statistics

from _claim import Claims
from _worlds import drive, loops, warm

CORES = 2  # worlds at a time; _worlds.py has larger numbers
ROUNDS = 5  # runs alone and together, in turns; the median counts
MORE = (4, 8)


def main() -> None:
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots-each", type=int, default=100)
    parser.add_argument("--seconds", type=float, default=5.0)
    chosen, claims = parser.parse_args(), Claims()
    warm()
    ratios, bare, alone = [], [], []
    for _ in range(ROUNDS):
        one = sum(drive(1, chosen.robots_each, chosen.seconds).used)
        two = sum(drive(2, chosen.robots_each, chosen.seconds).used) / 2
        alone.append(one / chosen.seconds)
        ratios.append(2 * one / two)
        bare.append(2 * loops(1) / loops(2))
    print(f"one shard takes {statistics.median(alone):.3f} cores for {chosen.robots_each} robots at real time")
    for shards in MORE:
        used = sum(drive(shards, chosen.robots_each, chosen.seconds, CORES).used) / chosen.seconds
        robots = shards * chosen.robots_each
        each = used / shards / statistics.median(alone)
        print(
            f"{shards} shards, {robots} robots in turns: {used:.2f} cores at real time, a shard {each:.2f} x one alone"
        )
    reference = statistics.median(bare)
    print(f"reference: two loops of plain Python do {reference:.2f} x one (runs {min(bare):.2f} to {max(bare):.2f})")
    print(f"two shards: runs {min(ratios):.2f} to {max(ratios):.2f}")
    claims.at_least("two shards, of one", statistics.median(ratios), 1.9, "x")
    claims.at_least("two shards, of two loops", statistics.median(ratios) / reference, 0.95, "x")
    claims.finish()


if __name__ == "__main__":
    main()
