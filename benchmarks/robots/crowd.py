"""Claim: in 200 seeded crowds of mixed bodies nothing that stands is displaced by more than 5 cm, and none lies.

Three to six robots in a room of 10 x 10 m stand, navigate or are driven blindly at up to their top speed for 20 s of
robot time. None may succeed where it is not, or be sure of a place where it is not.

    scripts/bench crowd [--crowds 200] [--first 0] [--seconds 20]
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from pathlib import Path

from _claim import Claims

sys.path.insert(0, str(Path(__file__).parents[2]))
from tests.crowd import SHOVED, Outcome, crowd


async def main(first: int, crowds: int, seconds: float) -> None:
    outcomes: list[Outcome] = []
    for seed in range(first, first + crowds):
        outcome = await crowd(seed, seconds)
        outcomes.append(outcome)
        lies = outcome.false_successes + outcome.sure_but_astray
        if lies or outcome.shoved > SHOVED:
            print(f"seed {seed}: {outcome.worst} displaced by {outcome.shoved:.3f} m; {'; '.join(lies)}", flush=True)
    claims, worst = Claims(), max(outcomes, key=lambda outcome: outcome.shoved)
    print(f"{crowds} crowds, bumpers pressed {sum(outcome.presses for outcome in outcomes)} times")
    claims.at_most("farthest that one was shoved", worst.shoved, SHOVED, "m")
    claims.at_most("false successes", sum(len(outcome.false_successes) for outcome in outcomes), 0.5, "robots")
    claims.at_most("sure but astray", sum(len(outcome.sure_but_astray) for outcome in outcomes), 0.5, "robots")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--crowds", type=int, default=200)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=20.0)
    arguments = parser.parse_args()
    asyncio.run(main(arguments.first, arguments.crowds, arguments.seconds))
