"""Claim: five buildings, three presets of realism, five seeds: ATE median <= 2 cm with the usual one, no wrong success.

The universal body (``+clean``, ``+usual``, ``+hard``) drives to ten places, twice, in their order around the middle of
the building: an office, a depot, a tower's floor, a corridor of 60 m and a ring of 120 m, which it maps as it goes. The
truth is the world's, the map's frame is where the robot woke up. A goal counts as reached wrongly when navigation says
it stands there and the truth is more than twice the tolerance away. ``--quick``: one seed.
"""

from __future__ import annotations

import asyncio
import math
import statistics
import sys
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field

import numpy as np
from _buildings import Building, building
from _claim import Claims

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import LocalizationLost
from roboglot.model.geometry import Point, Pose

WORLDS = ("office", "depot", "tower", "corridor", "ring")
PRESETS = ("clean", "usual", "hard")
SEEDS = (1, 2, 3, 4, 5)
GOALS, LAPS = 10, 2
TOLERANCE = 0.3  # m
USUAL_MAX = 0.02  # m
SECONDS_MAX = 180.0  # for one goal


@dataclass
class Tour:
    """Result of one run."""

    errors: list[float] = field(default_factory=list)
    reached: int = 0
    given_up: int = 0
    wrong: int = 0
    lost: int = 0

    @property
    def ate(self) -> float:
        """Root of the mean square distance from the truth, m."""
        return math.sqrt(statistics.fmean(error * error for error in self.errors))


def around(floor: np.ndarray[tuple[int, int], np.dtype[np.float64]], seed: int) -> list[Point]:
    """Places of the floor, in their order around its middle."""
    drawn = floor[np.random.default_rng(seed).integers(0, len(floor), GOALS)]
    middle = floor.mean(axis=0)
    turned = np.arctan2(drawn[:, 1] - middle[1], drawn[:, 0] - middle[0])
    return [Point(*drawn[number].tolist()) for number in np.argsort(turned)]


async def drive(house: Building, goals: list[Point]) -> Tour:
    tour, robot, clock = Tour(), house.fleet.robots["a"], house.clock

    def note_loss(_event: LocalizationLost) -> None:
        tour.lost += 1

    robot.events.listen(LocalizationLost, note_loss)
    for goal in goals:
        action = robot[Navigation].navigate_to([goal], NavigationOptions(tolerance=TOLERANCE, retries=2))
        end = clock.time() + SECONDS_MAX
        while not action.status.ended and clock.time() < end:
            await clock.advance(0.5)
            tour.errors.append(robot[Localization].pose.distance_to(house.truth))
        if action.error or not action.status.ended:
            action.cancel("it takes too long")
            await clock.advance(1.0)
            tour.given_up += 1
        elif house.truth.distance_to(goal) > 2 * TOLERANCE:
            tour.wrong += 1
        else:
            tour.reached += 1
    return tour


async def run(world: str, preset: str, seed: int) -> Tour:
    async with building(world, body=f"universal+{preset}", seed=seed) as house:
        robot = house.fleet.robots["a"]
        goals = around(house.floor(await house.survey()), seed)
        house.fleet.world.stage.place("a", house.start)
        await house.clock.advance(0.5)
        robot[Mapping].clear()
        robot[Localization].set_pose(Pose())
        robot[Mapping].enable(True)
        robot[Localization].enable(True)
        await house.clock.advance(1.0)
        return await drive(house, goals * LAPS)


def one(job: tuple[str, str, int]) -> Tour:
    return asyncio.run(run(*job))


def main() -> None:
    seeds = SEEDS[:1] if "--quick" in sys.argv else SEEDS
    jobs = [(world, preset, seed) for world in WORLDS for preset in PRESETS for seed in seeds]
    with ProcessPoolExecutor(2) as processes:
        tours = dict(zip(jobs, processes.map(one, jobs), strict=True))
    for world in WORLDS:
        for preset in PRESETS:
            mine = [tours[world, preset, seed] for seed in seeds]
            ates = " ".join(f"{100 * tour.ate:5.1f}" for tour in mine)
            goals = f"{sum(t.reached for t in mine)} reached, {sum(t.given_up for t in mine)} given up"
            print(
                f"{world:8} {preset:5} ATE {ates} cm, at most {100 * max(max(t.errors) for t in mine):6.1f}; {goals}, "
                f"{sum(t.wrong for t in mine)} wrong, lost {sum(t.lost for t in mine)} times",
                flush=True,
            )
    claims = Claims()
    usual = [tour.ate for (_, preset, _), tour in tours.items() if preset == "usual"]
    claims.at_most("ATE as usual, median", 100 * statistics.median(usual), 100 * USUAL_MAX, "cm")
    claims.at_most("goals reached at a wrong place", sum(tour.wrong for tour in tours.values()), 0, "")
    claims.finish()


if __name__ == "__main__":
    main()
