"""A robot carried to where its map does not reach maps on, and joins that when it is back on known ground."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.events import LocalizationLost, LocalizationRecovered, LostReason, ScanTaken
from roboglot.model.geometry import Pose, Twist, wrap_angle
from roboglot.simulation.components.sensing.lidar import SimulatedLidar
from tests.narrowing import of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

ROOM = ((3.0, 12.5), (9.0, 19.0))  # world, m: behind the door at (4, 11.5), two corners
NEAR = 0.15  # m


async def steer(tour: Tour, *spots: tuple[float, float]) -> None:
    """Drive it by hand, along its true place."""
    for x, y in spots:
        while (away := math.hypot(x - tour.truth.x, y - tour.truth.y)) > 0.2:
            off = wrap_angle(math.atan2(y - tour.truth.y, x - tour.truth.x) - tour.truth.yaw)
            ahead = 0.5 * max(0.0, math.cos(off)) if away > 0.4 else 0.2
            tour.robot[Driving].drive(Twist(x=ahead, yaw=1.5 * off), lifetime=0.3, source="by hand")
            await tour.clock.advance(0.1)
    await tour.clock.advance(0.5)


def walls_in(tour: Tour, corners: tuple[tuple[float, float], tuple[float, float]]) -> np.ndarray:
    """Return the map's occupied cells (n, 2; world, m) there."""
    grid = tour.robot[Mapping].grid
    rows, cols = np.nonzero(grid.log_odds > 0)
    c, s = math.cos(tour.start.yaw), math.sin(tour.start.yaw)
    x, y = grid.origin.x + (cols + 0.5) * grid.resolution, grid.origin.y + (rows + 0.5) * grid.resolution
    cells = np.stack([tour.start.x + c * x - s * y, tour.start.y + s * x + c * y], axis=1)
    return cells[((cells >= corners[0]) & (cells <= corners[1])).all(axis=1)]


@pytest.mark.slow  # a long story
@pytest.mark.world("office")
async def test_sightings_while_lost_are_joined_to_the_map(tour: Tour) -> None:
    news: list[LocalizationLost | LocalizationRecovered] = []
    await tour.go((12.0, 9.8))
    await tour.go((8.0, 9.8))
    tour.robot.events.listen(LocalizationLost, news.append)
    tour.robot.events.listen(LocalizationRecovered, news.append)
    through_the_door = len(walls_in(tour, ROOM))
    tour.world.stage.place("a", Pose(4.0, 14.5, math.radians(-90.0)))
    await tour.clock.advance(3.0)
    assert isinstance(news[-1], LocalizationLost)
    await steer(tour, (4.0, 13.0), (4.0, 10.2))
    assert len(walls_in(tour, ROOM)) < through_the_door + 20  # not on its map yet
    await steer(tour, (8.0, 9.8), (5.5, 9.8))
    assert isinstance(news[-1], LocalizationRecovered)
    assert tour.error[0] < 0.05
    seen = walls_in(tour, ROOM)
    assert len(seen) > through_the_door + 100
    await tour.go((4.0, 13.0))  # on the joined map
    await tour.go((7.0, 18.5))
    assert tour.truth.distance_to(Pose(7.0, 18.5)) < 0.1
    now = walls_in(tour, ROOM)
    off = np.hypot(*(seen[:, None] - now).transpose(2, 0, 1)).min(axis=1)
    assert np.quantile(off, 0.95) < NEAR
    assert tour.robot[Localization].quality > 0.8


@pytest.mark.world("office")
async def test_a_covered_lidar_is_a_silent_one(tour: Tour) -> None:
    news: list[LocalizationLost] = []
    await tour.go((20.0, 9.8))
    tour.robot.events.listen(LocalizationLost, news.append)
    lidar, odometry = tour.robot[Lidar], tour.robot[Odometry]
    assert lidar.scan is not None
    blind = replace(lidar.scan, ranges=np.full_like(lidar.scan.ranges, np.nan))
    of_kind(lidar, SimulatedLidar).silent = True
    for _ in range(40):
        now = tour.clock.time()
        tour.robot.events.publish(ScanTaken(stamp=now, scan=replace(blind, stamp=now), odometry=odometry.reading.pose))
        await tour.clock.advance(0.1)
    assert [event.reason for event in news] == [LostReason.NO_SCANS]
    of_kind(lidar, SimulatedLidar).silent = False
    await tour.clock.advance(5.0)
    assert tour.robot[Localization].lost is None
    assert tour.error[0] < 0.05
