"""Robots that meet in a tight building: no two touch, and all get where they are sent. Judged by the truth."""

from __future__ import annotations

import math

import pytest
import pytest_asyncio

from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from tests.meeting import WORLDS, Scenario, meet, scenario, survey

TIGHT = WORLDS[1]


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def building() -> OccupancyGrid:
    return await survey(TIGHT)


@pytest.mark.parametrize(
    "bodies", [("universal", "hermes"), pytest.param(("cyberdog2", "cyberdog2"), marks=pytest.mark.slow)]
)
@pytest.mark.asyncio(loop_scope="module")
async def test_two_pass_a_corridor_for_one(building: OccupancyGrid, bodies: tuple[str, ...]) -> None:
    """Each wants to where the other one is; the corridor between them has room for one."""
    west, east = Pose(5.0, 6.0), Pose(15.0, 6.0, math.pi)
    outcome = await meet(Scenario(3, TIGHT, bodies, (west, east), ((east,), (west,))), building)
    assert outcome.touches == []
    assert outcome.failures == []


@pytest.mark.slow  # in short: test_two_pass_a_corridor_for_one
@pytest.mark.asyncio(loop_scope="module")
async def test_who_stands_in_a_door_lets_others_out(building: OccupancyGrid) -> None:
    """Two want out of the room with one door; the third, who goes second, is on its way in."""
    starts = (Pose(9.8, 4.6, math.pi / 2), Pose(10.5, 4.2, math.pi / 2), Pose(10.0, 5.3, -math.pi / 2))
    goals = ((Pose(15.0, 6.0),), (Pose(5.0, 6.0),), (Pose(8.5, 1.7),))
    outcome = await meet(Scenario(4, TIGHT, ("universal", "hermes", "hermes"), starts, goals), building)
    assert outcome.touches == []
    assert outcome.failures == []


@pytest.mark.slow  # minutes of ten robots; two robots meet in the test above
@pytest.mark.parametrize("seed", [11, 17, 23])
@pytest.mark.asyncio(loop_scope="module")
async def test_ten_mixed_robots_meet_without_touching(building: OccupancyGrid, seed: int) -> None:
    outcome = await meet(scenario(seed), building)
    assert outcome.touches == []
    assert outcome.failures == []
