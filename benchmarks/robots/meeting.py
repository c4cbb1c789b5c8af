"""Claims: ten mixed robots that share a building never touch, all reach their goals, and lose at most a fifth of time.

Seeds are scenarios: even ones in the office (without the people that walk), odd ones in a building with a corridor for
one robot, narrow doors and a room with one door. Each robot has two goals; the time is compared with that of the same
drives alone. 200 scenarios take hours, so results are kept in a file: the next run goes on with the seeds that are
missing in it, and the figures are of all that it has of the same sources (--mixed: of any).

    scripts/bench meeting [--scenarios 20] [--first 0] [--workers 2] [--minutes 60] [--keep FILE] [--mixed]
                          [--without-alone]
"""

from __future__ import annotations

import argparse
import asyncio
import hashlib
import itertools
import json
import multiprocessing
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from dataclasses import asdict, dataclass, field
from pathlib import Path

from _claim import Claims

sys.path.insert(0, str(Path(__file__).parents[2]))
from roboglot.model.maps import OccupancyGrid
from tests.meeting import WORLDS, Scenario, meet, scenario, survey

STOOD_MAX = 60.0  # s: a robot that stays at one place for longer, before its last goal, is in a deadlock
maps: dict[str, OccupancyGrid] = {}  # of a worker, by world


@dataclass(frozen=True)
class Result:
    """Outcome of one scenario; ``seconds`` and ``alone`` by robot, ``stood``: the longest stay of each, s."""

    seed: int
    touches: list[str]
    failures: list[str]
    seconds: dict[str, float]
    alone: dict[str, float]
    stood: dict[str, float]
    false_successes: list[str] = field(default_factory=list)  # results that were kept earlier lack it

    @property
    def ratios(self) -> list[float]:
        """Times of the robots that were at all goals, each over its time alone."""
        return [seconds / self.alone[name] for name, seconds in self.seconds.items() if name in self.alone]


async def alone(scene: Scenario, grid: OccupancyGrid) -> dict[str, float]:
    """Return the seconds that each of its robots takes when there is no other."""
    seconds: dict[str, float] = {}
    for number in range(len(scene.bodies)):
        seconds |= (await meet(scene, grid, number)).seconds
    return seconds


async def play(seed: int, *, compare: bool) -> Result:
    """Play one scenario."""
    scene = scenario(seed)
    if scene.world not in maps:
        maps[scene.world] = await survey(scene.world)
    outcome = await meet(scene, maps[scene.world])
    single = await alone(scene, maps[scene.world]) if compare else {}
    touches = [f"{touch.names} after {touch.time:.1f} s: {touch.account}" for touch in outcome.touches]
    return Result(seed, touches, outcome.failures, outcome.seconds, single, outcome.stood, outcome.false_successes)


def work(seed: int, compare: bool) -> Result:
    """Play one scenario in a worker."""
    return asyncio.run(play(seed, compare=compare))


def run(seeds: Sequence[int], workers: int, until: float, *, compare: bool) -> Iterator[Result]:
    """Yield results as they come; none is begun after ``until``."""
    left = iter(seeds)
    with ProcessPoolExecutor(workers, multiprocessing.get_context("spawn")) as pool:
        running: set[Future[Result]] = {pool.submit(work, seed, compare) for seed in itertools.islice(left, workers)}
        while running:
            done, running = wait(running, return_when=FIRST_COMPLETED)
            for future in done:
                yield future.result()
                if time.monotonic() < until:
                    running |= {pool.submit(work, seed, compare) for seed in itertools.islice(left, 1)}


def report(results: Sequence[Result], claims: Claims, name: str) -> None:
    """Print the figures of one building, or of all."""
    robots = sum(len(result.seconds) + len(result.failures) for result in results)
    print(f"\n{name}: {len(results)} scenarios, {robots} robots")
    claims.at_most("touches", sum(len(result.touches) for result in results), 0.5, "")
    claims.at_most("not at all goals", sum(len(result.failures) for result in results), 0.5, f"of {robots}")
    false = sum(len(result.false_successes) for result in results)
    claims.at_most("drives that succeeded elsewhere", false, 0.5, "")
    stood = max((seconds for result in results for seconds in result.stood.values()), default=0.0)
    claims.at_most("longest stay at a place", stood, STOOD_MAX, "s")
    pairs = [(r.seconds[name], r.alone[name]) for r in results for name in r.seconds if name in r.alone]
    if pairs:
        together, apart = (sum(column) for column in zip(*pairs, strict=True))
        claims.at_most("time of all, with others", together / apart, 1.2, "x alone")
        single = sorted(ratio for result in results for ratio in result.ratios)
        median, most = statistics.median(single), single[int(0.9 * (len(single) - 1))]
        print(f"{'  of a robot: median, 90 %, worst':36} {median:9.2f} {most:.2f} {single[-1]:.2f} x alone", flush=True)


def sources() -> str:
    """Return a hash of what the figures are of."""
    root = Path(__file__).parents[2]
    files = [root / "tests/meeting.py", *sorted((root / "src/roboglot").rglob("*.py"))]
    files += sorted((root / "src/roboglot").rglob("*.toml"))
    return hashlib.sha256(b"".join(file.read_bytes() for file in files)).hexdigest()[:12]


def known(kept: Path, of: str, *, mixed: bool) -> dict[int, Result]:
    """Return the results in the file by seed: those of these sources, or of any."""
    results = dict[int, Result]()
    others = 0
    for line in kept.read_text().splitlines() if kept.exists() else ():
        fields = json.loads(line)
        if (found := fields.pop("sources", "")) != of:
            others += 1
        if found == of or mixed:
            results[fields["seed"]] = Result(**fields)
    if others:
        print(f"{others} results in {kept} are of other sources, and {'counted' if mixed else 'left out'}")
    return results


def main(options: argparse.Namespace) -> None:
    kept: Path = options.keep
    now = sources()
    results = known(kept, now, mixed=options.mixed)
    missing = [seed for seed in range(options.first, options.first + options.scenarios) if seed not in results]
    until = time.monotonic() + 60.0 * options.minutes
    with kept.open("a") as file:
        for result in run(missing, options.workers, until, compare=not options.without_alone):
            results[result.seed] = result
            print(json.dumps({"sources": now, **asdict(result)}), file=file, flush=True)
            times = f", {statistics.mean(result.ratios):.2f} x alone" if result.ratios else ""
            troubles = "; ".join(result.touches + result.failures + result.false_successes)
            print(f"seed {result.seed}: {troubles or 'no touch, all at both goals'}{times}", flush=True)
    claims = Claims()
    for number, world in enumerate(WORLDS):
        there = [result for seed, result in sorted(results.items()) if seed % len(WORLDS) == number]
        if there:
            report(there, claims, Path(world).stem)
    report(list(results.values()), claims, "all")
    print(f"\n{len(results)} scenarios are kept in {kept}")
    claims.finish()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--scenarios", type=int, default=20)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--minutes", type=float, default=60.0, help="no scenario is begun after so many")
    parser.add_argument("--keep", type=Path, default=Path(tempfile.gettempdir()) / "roboglot-meeting.jsonl")
    parser.add_argument("--mixed", action="store_true", help="count kept results of other sources, too")
    parser.add_argument("--without-alone", action="store_true")
    main(parser.parse_args())
