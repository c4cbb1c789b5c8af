"""Claims: ten mixed robots that share a building never touch, all reach their goals, and lose at most a fifth of time.

Seeds are scenarios: even ones in the office (without the people that walk), odd ones in a building with a corridor for
one robot, narrow doors and a room with one door. Each robot has two goals; the time is compared with that of the same
drives alone.

    scripts/bench meeting [--scenarios 20] [--first 0] [--without-alone]
"""

from __future__ import annotations

import argparse
import asyncio
import sys
from pathlib import Path

from _claim import Claims

sys.path.insert(0, str(Path(__file__).parents[2]))
from roboglot.model.maps import OccupancyGrid
from tests.meeting import Outcome, Scenario, meet, scenario, survey


async def alone(scene: Scenario, grid: OccupancyGrid) -> dict[str, float]:
    """The seconds that each of its robots takes when there is no other."""
    seconds: dict[str, float] = {}
    for number in range(len(scene.bodies)):
        seconds |= (await meet(scene, grid, number)).seconds
    return seconds


async def main(first: int, count: int, *, compare: bool) -> None:
    maps: dict[str, OccupancyGrid] = {}
    outcomes: list[Outcome] = []
    together = apart = 0.0
    robots = 0
    for seed in range(first, first + count):
        scene = scenario(seed)
        if scene.world not in maps:
            maps[scene.world] = await survey(scene.world)
        outcome = await meet(scene, maps[scene.world])
        outcomes.append(outcome)
        robots += len(scene.bodies)
        single = await alone(scene, maps[scene.world]) if compare else {}
        both = outcome.seconds.keys() & single.keys()
        together, apart = together + sum(outcome.seconds[n] for n in both), apart + sum(single[n] for n in both)
        touched = "; ".join(f"{touch.names} after {touch.time:.1f} s" for touch in outcome.touches)
        print(
            f"seed {seed}: touches: {touched or 'none'}; not there: {'; '.join(outcome.failures) or 'none'}", flush=True
        )
    claims = Claims()
    claims.at_most("touches", sum(len(outcome.touches) for outcome in outcomes), 0.5, f"in {count} scenarios")
    claims.at_most("not at all goals", sum(len(o.failures) for o in outcomes), 0.5, f"of {robots} robots")
    if compare:
        claims.at_most("time, with others", together / apart, 1.2, "x the time alone")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenarios", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--without-alone", action="store_true")
    arguments = parser.parse_args()
    asyncio.run(main(arguments.first, arguments.scenarios, compare=not arguments.without_alone))
