"""Claim: 100 kidnappings, 100 blackouts while mapping: always reported, >= 95 % recovered, no wall twice in the map.

A kidnapped robot is carried to another place of the floor that it has mapped; a blackout is ten seconds without scans
in which it is pushed up to 3 m. It drives about and maps meanwhile. Reported: ``LocalizationLost`` or
``RobotDisplaced`` within 10 s. Recovered: within 60 s the place is known again, to 15 cm and 5 degrees; a robot that
does not find it standing may look around. A wall is there twice where the map shows half a metre of one, and scans
painted at where the robot truly was show none within 15 cm. ``--quick``: one tour a building; ``--show``: each event.
"""

from __future__ import annotations

import asyncio
import contextlib
import math
import sys
from collections import Counter
from dataclasses import dataclass, field

import numpy as np
from _buildings import Building, building
from _claim import Claims
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.grid_import import evidence_of
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.kernels.distance import distances
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.navigation import Navigation, NavigationOptions
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.errors import Refused
from roboglot.model.events import LocalizationLost, RobotDisplaced, ScanTaken
from roboglot.model.geometry import Point, Pose, wrap_angle
from roboglot.model.maps import OccupancyGrid

TOURS = {"office": 4, "depot": 3, "tower": 3}  # for ten kidnappings and ten blackouts
EVENTS = 20
DRIVEN_SECONDS = 25.0  # between two events
REPORT_SECONDS, STANDING_SECONDS, RECOVERED_SECONDS = 10.0, 20.0, 60.0
GOOD, GOOD_YAW = 0.15, math.radians(5.0)
BLACKOUT_SECONDS, PUSHED = 10.0, 3.0  # s, m at most
CARRIED_MIN = 3.0  # m
DOUBLED, DOUBLED_LENGTH = 0.15, 0.5  # m away from walls, m travelled
RECOVERED_SHARE = 0.95


@dataclass
class Trial:
    """One robot on its tour, and what was counted."""

    house: Building
    draw: np.random.Generator
    floor: NDArray[np.float64]  # (n, 2) in m, map frame: places with enough room
    truth: EvidenceGrid = field(default_factory=EvidenceGrid)
    count: Counter[str] = field(default_factory=Counter)
    reports: list[float] = field(default_factory=list)
    painted: float = -math.inf

    def __post_init__(self) -> None:
        robot, reader = self.house.fleet.robots["a"], ScanReader()
        self.robot = robot

        def look(event: ScanTaken) -> None:
            if event.stamp - self.painted >= 0.5:
                self.painted = event.stamp
                points = reader.read(event.scan)
                if len(points.points):
                    paint(self.truth, points, self.house.truth, fill=True)

        robot.events.listen(ScanTaken, look)
        robot.events.listen(LocalizationLost, lambda event: self.reports.append(event.stamp))
        robot.events.listen(RobotDisplaced, lambda event: self.reports.append(event.stamp))

    @property
    def is_right(self) -> bool:
        pose, truth = self.robot[Localization].pose, self.house.truth
        return pose.distance_to(truth) < GOOD and abs(wrap_angle(pose.yaw - truth.yaw)) < GOOD_YAW

    async def drive(self, seconds: float) -> None:
        """About, to places drawn from the whole floor."""
        end, options = self.house.clock.time() + seconds, NavigationOptions(tolerance=0.4, retries=1)
        while self.house.clock.time() < end:
            goal = Point(*self.floor[self.draw.integers(len(self.floor))].tolist())
            action = self.robot[Navigation].navigate_to([goal], options)
            while not action.status.ended and self.house.clock.time() < end:
                await self.house.clock.advance(0.5)

    async def kidnap(self) -> None:
        """Carry it to another place of the floor mapped so far."""
        known = self.house.floor(mapped(self.robot[Mapping].grid))
        away = known[np.hypot(*(known - (self.house.truth.x, self.house.truth.y)).T) > CARRIED_MIN]
        spot = (away if len(away) else known)[self.draw.integers(len(away) or len(known))]
        await self.house.put(Pose(float(spot[0]), float(spot[1]), float(self.draw.uniform(-math.pi, math.pi))))

    async def black_out(self) -> None:
        """Push it about while its lidar is silent."""
        lidar, began = self.robot[Lidar], self.house.truth
        lidar.silent = True  # type: ignore[attr-defined]
        near = self.floor[np.hypot(*(self.floor - (began.x, began.y)).T) < PUSHED]
        spot = near[self.draw.integers(len(near))]
        turn, steps = float(self.draw.uniform(-1.5, 1.5)), 20
        for step in range(1, steps + 1):
            await self.house.clock.advance(BLACKOUT_SECONDS / steps)
            part = step / steps
            x, y = began.x + part * (spot[0] - began.x), began.y + part * (spot[1] - began.y)
            self.put(Pose(float(x), float(y), wrap_angle(began.yaw + part * turn)))
        lidar.silent = False  # type: ignore[attr-defined]

    def put(self, pose: Pose) -> None:
        """Push it there, unless a person stands in the way."""
        with contextlib.suppress(Refused):
            self.house.fleet.world.stage.place("a", self.house.start.compose(pose))

    async def suffer(self, name: str) -> None:
        """One event, and what came of it."""
        clock, localization, began = self.house.clock, self.robot[Localization], self.house.clock.time()
        self.reports.clear()
        if localization.lost is not None:  # still reported: it was pushed beyond its map
            self.reports.append(began)
        await (self.kidnap() if name == "kidnapping" else self.black_out())
        deadline, found, looked = clock.time() + RECOVERED_SECONDS, math.inf, False
        after = clock.time()
        while clock.time() < deadline and not math.isfinite(found):
            await clock.advance(1.0)
            if clock.time() - after >= 3.0 and localization.lost is None and self.is_right:
                found = clock.time() - after
            elif clock.time() - after >= STANDING_SECONDS and not looked:
                looked = True
                localization.relocalize(may_move=True)
        reported = bool(self.reports) and min(self.reports) <= after + REPORT_SECONDS
        self.count[name] += 1
        self.count[f"{name} reported"] += reported
        self.count[f"{name} recovered"] += math.isfinite(found)
        self.count[f"{name} wrong"] += not math.isfinite(found) and localization.lost is None
        if "--show" in sys.argv or not reported or not math.isfinite(found):
            off = localization.pose.distance_to(self.house.truth)
            print(
                f"    {name} at {began:.0f} s: {'' if reported else 'NOT '}reported, found after {found:.0f} s, "
                f"{off:.2f} m off, {localization.lost}; {self.house.truth}",
                flush=True,
            )
        if not math.isfinite(found):  # the tour continues from the robot's place
            localization.set_pose(self.house.truth)
            await clock.advance(3.0)


def mapped(grid: OccupancyGrid) -> EvidenceGrid:
    """Return the robot's map, to ask it for floor."""
    return evidence_of(grid)


def doubled(grid: OccupancyGrid, truth: EvidenceGrid) -> int:
    """Walls that the map shows where the truth has none."""
    import cv2

    shown = np.argwhere(grid.log_odds > 0)
    col0, row0 = round(grid.origin.x / RESOLUTION), round(grid.origin.y / RESOLUTION)
    shown += (row0 - truth.first_row, col0 - truth.first_column)
    off = distances((truth.evidence > 0).astype(np.uint8), 20.0) * RESOLUTION
    height, width = off.shape
    inside = (shown >= 0).all(axis=1) & (shown[:, 0] < height) & (shown[:, 1] < width)
    wrong = np.zeros(off.shape, np.uint8)
    rows, cols = shown[inside].T
    wrong[rows, cols] = off[rows, cols] > DOUBLED
    number, _, boxes, _ = cv2.connectedComponentsWithStats(wrong, connectivity=8)
    sizes = np.hypot(boxes[1:number, 2], boxes[1:number, 3]) * RESOLUTION
    return int((sizes >= DOUBLED_LENGTH).sum())


async def tour(name: str, seed: int) -> Counter[str]:
    """Drive through one building, with ten events of each kind; return the counts of verdicts."""
    async with building(name, seed=seed) as house:
        robot = house.fleet.robots["a"]
        floor = house.floor(await house.survey())
        await house.put(Pose())
        await house.clock.advance(0.5)
        robot[Mapping].clear()
        robot[Localization].set_pose(Pose())
        robot[Mapping].enable(True)
        robot[Localization].enable(True)
        trial = Trial(house, np.random.default_rng(seed), floor)
        await house.clock.advance(1.0)
        origin = robot[Localization].pose
        assert origin.distance_to(Pose()) < 0.1, origin
        await trial.drive(2 * DRIVEN_SECONDS)
        for number in range(EVENTS):
            await trial.suffer("kidnapping" if number % 2 else "blackout")
            await trial.drive(DRIVEN_SECONDS)
        trial.count["doubled"] = doubled(robot[Mapping].grid, trial.truth)
        print(f"{name:7} seed {seed}", dict(sorted(trial.count.items())), flush=True)
        return trial.count


async def main() -> None:
    total = Counter[str]()
    asked = [name for name in TOURS if name in sys.argv] or TOURS
    for name, tours in TOURS.items():
        if name not in asked:
            continue
        for seed in range(1, 2 if "--quick" in sys.argv else tours + 1):
            total += await tour(name, seed)
    claims = Claims()
    for kind in ("kidnapping", "blackout"):
        count = max(1, total[kind])
        claims.at_least(f"{kind}s", total[kind], 1 if "--quick" in sys.argv else 100, "")
        claims.at_least(f"{kind}s reported", 100.0 * total[f"{kind} reported"] / count, 100.0, "%")
        claims.at_least(f"{kind}s recovered", 100.0 * total[f"{kind} recovered"] / count, 100.0 * RECOVERED_SHARE, "%")
        claims.at_most(f"{kind}s found at a wrong place", total[f"{kind} wrong"], 0, "")
    claims.at_most("walls that are there twice", total["doubled"], 0, "")
    claims.finish()


if __name__ == "__main__":
    asyncio.run(main())
