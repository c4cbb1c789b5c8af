"""Robots that meet in a tight building: no two touch, and all get where they are sent. Judged by the truth."""

from __future__ import annotations

import math

import pytest
import pytest_asyncio

from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from tests.meeting import WORLDS, Drive, Scenario, meet, scenario, survey

TIGHT = WORLDS[1]
LONG = 12.0  # s


@pytest_asyncio.fixture(scope="module", loop_scope="module")
async def building() -> OccupancyGrid:
    return await survey(TIGHT)


@pytest.mark.slow  # in short: test_two_change_places
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
    assert outcome.false_successes == []


@pytest.mark.parametrize(
    ("bodies", "ends"),
    [
        pytest.param(("universal", "hermes"), (Pose(5.5, 9.5), Pose(8.6, 9.5, math.pi)), id="door"),
        pytest.param(
            ("hermes", "cyberdog2"),
            (Pose(10.0, 3.6, math.pi / 2), Pose(5.6, 6.0)),
            id="dead end",
            marks=pytest.mark.slow,
        ),
    ],
)
@pytest.mark.asyncio(loop_scope="module")
async def test_two_change_places(building: OccupancyGrid, bodies: tuple[str, ...], ends: tuple[Pose, Pose]) -> None:
    """Through a door; and between a hall and a room with one door, where one of them announces nothing."""
    outcome = await meet(Scenario(5, TIGHT, bodies, ends, ((ends[1],), (ends[0],))), building)
    assert outcome.touches == []
    assert outcome.failures == []
    assert outcome.false_successes == []
    assert max(outcome.stood.values()) < LONG


@pytest.mark.slow  # in short: test_two_change_places
@pytest.mark.asyncio(loop_scope="module")
async def test_three_cross_at_one_place(building: OccupancyGrid) -> None:
    starts = (Pose(2.0, 5.5), Pose(4.5, 8.0, -math.pi / 2), Pose(6.0, 4.5, 2.5))
    goals = ((Pose(6.2, 5.5),), (Pose(4.5, 3.6),), (Pose(2.6, 7.0),))
    outcome = await meet(Scenario(6, TIGHT, ("universal", "cyberdog2", "hermes"), starts, goals), building)
    assert outcome.touches == []
    assert outcome.failures == []
    assert outcome.false_successes == []
    assert max(outcome.seconds.values()) < LONG


@pytest.mark.slow  # in short: test_two_change_places
@pytest.mark.asyncio(loop_scope="module")
async def test_robot_in_a_doorway_lets_others_out(building: OccupancyGrid) -> None:
    """Two want out of the room with one door; the third, who goes second, is on its way in."""
    starts = (Pose(9.8, 4.6, math.pi / 2), Pose(10.5, 4.2, math.pi / 2), Pose(10.0, 5.3, -math.pi / 2))
    goals = ((Pose(15.0, 6.0),), (Pose(5.0, 6.0),), (Pose(8.5, 1.7),))
    outcome = await meet(Scenario(4, TIGHT, ("universal", "hermes", "hermes"), starts, goals), building)
    assert outcome.touches == []
    assert outcome.failures == []
    assert outcome.false_successes == []


@pytest.mark.slow  # minutes of ten robots; two robots meet in the test above
@pytest.mark.parametrize("seed", [11, 17, 23])
@pytest.mark.asyncio(loop_scope="module")
async def test_ten_mixed_robots_meet_without_touching(building: OccupancyGrid, seed: int) -> None:
    outcome = await meet(scenario(seed), building)
    assert outcome.touches == []
    assert outcome.failures == []
    assert outcome.false_successes == []


def test_a_success_beside_the_goal_is_counted() -> None:
    drive = Drive("r0", (Pose(1.0, 2.0), Pose(5.0, 2.0)))
    drive.arrive(Pose(1.02, 2.0))
    drive.arrive(Pose(5.0, 2.3))
    assert drive.reached == 2
    assert drive.false_successes == ["r0 succeeded 0.30 m beside goal 1"]
