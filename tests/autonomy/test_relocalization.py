"""Finding the place in a known map: judged by the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.localization import Localization, Region
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import InvalidGoal, NotLocalized
from roboglot.model.events import LocalizationLost, LocalizationRecovered, PoseJumped
from roboglot.model.geometry import Pose

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


async def carried(tour: Tour, x: float, y: float, deg: float) -> None:
    """Somebody carries the robot there while its lidar's scans are not looked at."""
    tour.robot[Mapping].enable(False)
    tour.robot[Localization].enable(False)
    tour.world.hands.place("a", Pose(x, y, math.radians(deg)))
    await tour.clock.advance(0.3)


@pytest.mark.world("office")
async def test_a_robot_carried_elsewhere_finds_itself(tour: Tour) -> None:
    await tour.go((12.0, 9.8))
    await tour.go((12.0, 6.5))
    jumps: list[PoseJumped] = []
    tour.robot.events.listen(PoseJumped, jumps.append)
    for x, y, deg in ((20.0, 10.2, 170.0), (13.0, 6.6, -60.0), (9.5, 9.7, 30.0)):
        await carried(tour, x, y, deg)
        assert tour.error[0] > 1.0
        action = await tour.end_of(tour.robot[Localization].relocalize())
        tour.robot[Localization].enable(True)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        assert tour.error[0] < 0.05
        assert tour.error[1] < 1.0
        assert tour.robot[Localization].quality > 0.8
        assert jumps[-1].pose.distance_to(tour.robot[Localization].pose) < 0.01


@pytest.mark.world("office")
async def test_a_kidnapped_robot_says_so_and_recovers(tour: Tour) -> None:
    await tour.go((12.0, 9.8))
    await tour.go((12.0, 6.5))
    news: list[LocalizationLost | LocalizationRecovered] = []
    tour.robot.events.listen(LocalizationLost, news.append)
    tour.robot.events.listen(LocalizationRecovered, news.append)
    for x, y, deg in ((20.0, 10.2, 170.0), (13.0, 6.6, -60.0), (9.5, 9.7, 30.0)):
        walls = int((tour.robot[Mapping].grid.log_odds > 0).sum())
        tour.world.hands.place("a", Pose(x, y, math.radians(deg)))
        await tour.clock.advance(5.0)
        lost, found = news[0], news[-1]  # it may lose a place again that it believed too soon
        assert isinstance(lost, LocalizationLost)
        assert isinstance(found, LocalizationRecovered)
        assert 0.0 <= found.seconds <= found.stamp - lost.stamp + 1e-6
        assert tour.robot[Localization].lost is None
        assert tour.error[0] < 0.05
        assert int((tour.robot[Mapping].grid.log_odds > 0).sum()) < walls + 150  # a scan at a wrong place draws 250
        news.clear()


@pytest.mark.world("office")
async def test_in_a_region_it_looks_only_there(tour: Tour) -> None:
    await tour.go((12.0, 9.8))
    await carried(tour, 20.0, 10.2, 170.0)
    here, there = tour.on_map(20.0, 10.2), tour.on_map(12.0, 6.5)
    for region, status in (
        (Region(there.x - 1, there.y - 1, there.x + 1, there.y + 1), ActionStatus.ABORTED),
        (Region(here.x - 1, here.y - 1, here.x + 1, here.y + 1), ActionStatus.SUCCEEDED),
    ):
        action = await tour.end_of(tour.robot[Localization].relocalize(region))
        assert action.status is status, action.reason
        if status is ActionStatus.ABORTED:
            assert isinstance(action.error, NotLocalized)
            assert tour.error[0] > 1.0
    assert tour.error[0] < 0.05


async def test_no_region_is_refused(tour: Tour) -> None:
    for region in (Region(1.0, 0.0, 0.0, 1.0), Region(0.0, 0.0, math.nan, 1.0), Region(0.0, 0.0, math.inf, 1.0)):
        with pytest.raises(InvalidGoal):
            tour.robot[Localization].relocalize(region)
