"""The buildings that localization is measured in, and a map of one as a careful survey leaves it."""

from __future__ import annotations

import contextlib
import math
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanReader
from roboglot.config import RobotConfig
from roboglot.fleet import Fleet, build_fleet
from roboglot.kernels.distance import distances
from roboglot.model.clock import LockstepClock
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.errors import Refused
from roboglot.model.geometry import Pose
from roboglot.model.sensing import LaserScan
from roboglot.storage.database import Database

HERE = Path(__file__).parent
TESTS = HERE.parent / "tests"
BUILDINGS = {
    "office": "office",
    "depot": str(TESTS / "data" / "maps" / "depot.yaml"),
    "tower": str(TESTS / "protocols" / "slamware" / "data" / "tower.toml"),
    "corridor": str(HERE / "worlds" / "corridor.toml"),
    "ring": str(HERE / "worlds" / "ring.toml"),
    "twins": str(HERE / "worlds" / "twins.toml"),
}
PATIENCE = 20  # s to wait for people to leave a place
SURVEYED = 1.6  # m between two surveyed places
MARGIN = 0.1  # m of clearance beside the hull


@dataclass
class Building:
    """One robot in one building; ``start`` is the map's origin in the world."""

    fleet: Fleet
    clock: LockstepClock
    start: Pose

    @property
    def truth(self) -> Pose:
        """base_link in the map's frame."""
        return self.fleet.world.truth.pose_of("a").relative_to(self.start)

    async def put(self, pose: Pose) -> None:
        """Put the robot there (map frame), once people have left the place. Raises Refused if they stay."""
        for last in (*[False] * PATIENCE, True):
            try:
                self.fleet.world.stage.place("a", self.start.compose(pose))
                return
            except Refused:
                if last:
                    raise
            await self.clock.advance(1.0)

    async def scan_at(self, pose: Pose) -> LaserScan:
        """Put the robot there (map frame) and let it scan. Raises Refused."""
        await self.put(pose)
        await self.clock.advance(0.25)
        scan = self.fleet.robots["a"][Lidar].scan
        assert scan is not None
        return scan

    def floor(self, grid: EvidenceGrid) -> npt.NDArray[np.float64]:
        """Places (n, 2; m) on known floor where the hull has room."""
        room = distances((grid.evidence >= 0).astype(np.uint8), 20.0) * 0.05
        rows, columns = np.nonzero(room > self.fleet.robots["a"].description.radius + MARGIN)
        cells = np.stack([columns, rows], axis=1).astype(np.float64)
        return (cells + 0.5) * 0.05 + (grid.corner.x, grid.corner.y)

    async def survey(self, east: float = math.inf) -> EvidenceGrid:
        """Return a map of all that can be reached without going farther ``east`` (m from the start)."""
        grid, reader, seen, yaw = EvidenceGrid(), ScanReader(), [(0.0, 0.0)], 0.0
        while True:
            with contextlib.suppress(Refused):  # a person sits there
                scan = await self.scan_at(Pose(*seen[-1], yaw))
                for _ in range(3):
                    paint(grid, reader.read(scan), self.truth, fill=True)
            floor = self.floor(grid)[::7]
            floor = floor[floor[:, 0] < east]
            away = np.hypot(*(floor[:, None] - np.array(seen)).T).min(axis=0)
            fresh = floor[away > SURVEYED]
            if not len(fresh):
                return grid
            nearest = fresh[np.hypot(*(fresh - seen[-1]).T).argmin()]
            seen.append((float(nearest[0]), float(nearest[1])))
            yaw += 2.4


@asynccontextmanager
async def building(name: str, body: str = "universal", seed: int = 3) -> AsyncIterator[Building]:
    """Yield the named building, or the one of a world file, with a robot whose localization and mapping stand still."""
    clock, database = LockstepClock(), Database(":memory:")
    fleet = build_fleet(BUILDINGS.get(name, name), [RobotConfig(body=body)], clock=clock, seed=seed, database=database)
    await fleet.start(wait=True)
    robot = fleet.robots["a"]
    await clock.advance(0.5)
    robot[Mapping].enable(False)
    robot[Localization].enable(False)
    try:
        yield Building(fleet, clock, fleet.world.truth.pose_of("a"))
    finally:
        await fleet.close()
        database.close()
