"""Claim: along a bare corridor the pose's error is what its covariance says, whether wheels slip or hands push.

A lidar that sees 4 m, in a corridor of 60 m with furniture at its west end alone. The robot drives 24 m along it in
three goals, on the map of a survey or making its own, with wheels as described, with jumping encoders, with wrong
wheels (the preset ``hard``), and pushed back by some centimetres every 2 m. The ratio is that of the squared error to
the variance along the corridor (1 is ideal), and at most 4 standard deviations of error are allowed in any run.
``--quick``: two seeds.
"""

from __future__ import annotations

import asyncio
import math
import re
import statistics
import sys
import tempfile
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path

from _buildings import Building, building
from _claim import Claims

from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.events import Event, LocalizationLost, RobotDisplaced
from roboglot.model.geometry import Pose, Vector3
from roboglot.simulation.bodies.files import BODIES

KINDS: dict[str, dict[str, str]] = {  # of odometry: what replaces the universal body's values
    "plain": {},
    "slipping": {"still_rate": "0.01\njump = 0.03\njump_every = 2.0"},
    "hard": {"scale_error": "0.06", "noise": "0.09"},
    "pushed": {},
}
BARE = str(Path(__file__).parents[1] / "worlds" / "bare.toml")
MAPS = ("surveyed", "own")
SEEDS = tuple(range(1, 9))
GOALS = (15.0, 23.0, 31.0)  # m from the west wall
BARE_FROM = 11.0  # m: from here on nothing but walls is in sight
PUSH, PUSHED_EVERY = 12.0, 2.0  # N s; m driven
SECONDS_MAX = 120.0  # for one goal
TOLERANCE = 0.3  # m
RATIO_MAX, SIGMAS_MAX = 2.0, 4.0


@dataclass
class Drive:
    """Result of one run; ``along``: error and standard deviation along the corridor where it is bare, m."""

    along: list[tuple[float, float]] = field(default_factory=list)
    across: list[tuple[float, float]] = field(default_factory=list)
    ended: list[tuple[bool, float]] = field(default_factory=list)  # whether it succeeded; m from the goal
    reports: int = 0

    @property
    def sigmas(self) -> float:
        """Largest error along the corridor, in standard deviations."""
        return max(abs(error) / sigma for error, sigma in self.along)


def body_of(kind: str, folder: Path) -> str:
    text = (BODIES / "universal.toml").read_text()
    for key, value in {"range_max": "4.0", **KINDS[kind]}.items():
        text = re.sub(rf"(?m)^{key} = [\d.]+", f"{key} = {value}", text, count=1)
    path = folder / f"{kind}.toml"
    path.write_text(text)
    return str(path)


class Watch:
    """Notes errors and standard deviations, and pushes the robot back."""

    def __init__(self, house: Building, kind: str) -> None:
        self.drive, self._house, self._kind = Drive(), house, kind
        self._pushed_at = BARE_FROM + house.start.x

    def note(self) -> None:
        house = self._house
        robot, truth = house.fleet.robots["a"], house.truth
        place = house.fleet.world.truth.pose_of("a")
        localization = robot[Localization]
        assert isinstance(localization, LidarLocalization)
        assert localization.estimator is not None
        covariance, pose = localization.estimator.trajectory()[-1].covariance, localization.pose
        if place.x > BARE_FROM:
            self.drive.along.append((pose.x - truth.x, math.sqrt(covariance[0, 0])))
            self.drive.across.append((pose.y - truth.y, math.sqrt(covariance[1, 1])))
        if self._kind == "pushed" and place.x > self._pushed_at:
            self._pushed_at += PUSHED_EVERY
            house.fleet.world.stage.push("a", Vector3(-PUSH, 0.0, 0.0))


async def drive(house: Building, kind: str) -> Drive:
    robot, clock, watch = house.fleet.robots["a"], house.clock, Watch(house, kind)

    def report(_event: Event) -> None:
        watch.drive.reports += 1

    robot.events.listen(LocalizationLost, report)
    robot.events.listen(RobotDisplaced, report)
    for goal in GOALS:
        to = Pose(goal, 1.2).relative_to(house.start).point
        action = robot[Navigation].navigate_to([to], NavigationOptions(tolerance=TOLERANCE, retries=2))
        end = clock.time() + SECONDS_MAX
        while not action.status.ended and clock.time() < end:
            await clock.advance(0.3)
            watch.note()
        action.cancel("it takes too long")
        await clock.advance(1.0)
        watch.note()
        watch.drive.ended.append((action.error is None, house.truth.distance_to(to)))
    return watch.drive


async def run(kind: str, mapped: str, seed: int) -> Drive:
    with tempfile.TemporaryDirectory() as folder:
        async with building(BARE, body=body_of(kind, Path(folder)), seed=seed) as house:
            robot = house.fleet.robots["a"]
            if mapped == "surveyed":
                grid = await house.survey(east=45.0)
                await house.put(Pose())
                robot[Mapping].load(grid.occupancy(), Pose())
            robot[Localization].enable(True)
            robot[Mapping].enable(mapped == "own")
            await house.clock.advance(2.0)
            return await drive(house, kind)


def one(job: tuple[str, str, int]) -> Drive:
    return asyncio.run(run(*job))


def ratio(pairs: Iterator[tuple[float, float]]) -> float:
    return statistics.fmean((error / sigma) ** 2 for error, sigma in pairs)


def main() -> None:
    seeds = SEEDS[:2] if "--quick" in sys.argv else SEEDS
    jobs = [(kind, mapped, seed) for kind in KINDS for mapped in MAPS for seed in seeds]
    with ProcessPoolExecutor(2) as processes:
        drives = dict(zip(jobs, processes.map(one, jobs), strict=True))
    claims = Claims()
    for kind in KINDS:
        for mapped in MAPS:
            mine = [drives[kind, mapped, seed] for seed in seeds]
            last = [one.along[-1] for one in mine]
            print(
                f"{kind:9} {mapped:9} errors at the end "
                + " ".join(f"{100 * error:5.1f}" for error, _ in last)
                + f" cm, sigma {100 * statistics.fmean(sigma for _, sigma in last):5.1f}; at most "
                f"{max(one.sigmas for one in mine):5.1f} sigmas; ratio along "
                f"{ratio(pair for one in mine for pair in one.along):6.2f}, "
                f"across {ratio(pair for one in mine for pair in one.across):5.2f}; "
                f"{sum(well for one in mine for well, _ in one.ended)} of {len(mine) * len(GOALS)} succeeded, "
                f"at most {100 * max(off for one in mine for well, off in one.ended if well):5.1f} cm off; "
                f"{sum(one.reports for one in mine)} reports",
                flush=True,
            )
    along = [pair for one in drives.values() for pair in one.along]
    claims.at_most("squared error along, in variances", ratio(iter(along)), RATIO_MAX, "")
    claims.at_most("largest error", max(one.sigmas for one in drives.values()), SIGMAS_MAX, "sigmas")
    claims.finish()


if __name__ == "__main__":
    main()
