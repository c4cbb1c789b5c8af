"""Following a walking person: judged by the world."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.following import Following, FollowSide
from roboglot.model.components.system.bluetooth import Bluetooth
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.geometry import Pose

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

WALKER = str(Path(__file__).parent / "worlds" / "walker.toml")


@pytest.mark.parametrize(
    "side", [FollowSide.LEFT, *(pytest.param(side, marks=pytest.mark.slow) for side in FollowSide if side != "left")]
)
@pytest.mark.world(WALKER)
async def test_it_keeps_near_who_walks(tour: Tour, side: FollowSide) -> None:
    action, gaps = tour.robot[Following].follow(side=side, distance=1.2), []
    for _ in range(250):
        await tour.clock.advance(0.1)
        gaps.append(tour.truth.distance_to(tour.world.truth.people[0][1]))
    assert action.status is ActionStatus.EXECUTING, action.reason
    assert tour.truth.x > 8.0
    assert max(gaps[50:]) < 2.4
    assert min(gaps) > 0.5
    assert not tour.bumps
    action.cancel()
    await tour.end_of(action)
    assert action.status is ActionStatus.CANCELED


@pytest.mark.slow  # in short: test_without_anybody_it_gives_up
@pytest.mark.world("playground", body="cyberdog2")
async def test_it_stands_still_near_a_person_unseen(tour: Tour) -> None:
    anna = tour.world.stage.person("anna")
    tour.world.stage.place("a", Pose(anna.pose.x - 2.0, anna.pose.y, 0.0))
    action, gaps, searched = tour.robot[Following].follow(distance=1.0), [], 0
    for _ in range(140):
        await tour.clock.advance(0.1)
        gaps.append(tour.truth.distance_to(anna.pose))
        searched += action.feedback == "searching" and len(gaps) > 20
    assert max(gaps[60:]) - min(gaps[60:]) < 0.05
    assert 0.8 < gaps[-1] < 1.2
    assert searched == 0
    action.cancel()


@pytest.mark.world("empty")
async def test_without_anybody_it_gives_up(tour: Tour) -> None:
    begun = tour.truth
    action = await tour.end_of(tour.robot[Following].follow())
    assert isinstance(action.error, NotFound)
    assert tour.truth.distance_to(begun) < 0.02
    with pytest.raises(InvalidGoal):
        tour.robot[Following].follow(distance=0.1)


BRACELET = str(Path(__file__).parent / "worlds" / "bracelet.toml")


async def followed(tour: Tour, action: object, seconds: float) -> list[float]:
    """Distances to the person in the world, ten a second."""
    gaps = []
    for _ in range(int(seconds * 10)):
        await tour.clock.advance(0.1)
        gaps.append(tour.truth.distance_to(tour.world.truth.people[0][1]))
    return gaps


@pytest.mark.slow  # in short: test_it_keeps_near_who_walks
@pytest.mark.parametrize(
    "body",
    [
        pytest.param("cyberdog2", marks=pytest.mark.world(BRACELET, body="cyberdog2")),
        pytest.param("universal", marks=[pytest.mark.world(BRACELET, body="universal"), pytest.mark.slow]),
    ],
)
async def test_a_bracelet_is_followed_through_doors(tour: Tour, body: str) -> None:
    link = tour.robot[Bluetooth].connect("C0:FF:EE:00:00:01")
    await tour.end_of(link)
    action = tour.robot[Following].follow_tag(distance=1.0)
    gaps = await followed(tour, action, 26.0)
    assert action.status is ActionStatus.EXECUTING, action.reason
    assert tour.truth.x > 6.5
    assert max(gaps) < 4.0
    assert min(gaps[30:]) > 0.5
    assert not tour.bumps


@pytest.mark.slow  # long; in short: test_it_keeps_near_who_walks
@pytest.mark.world(BRACELET)
async def test_a_person_is_followed_round_the_corner(tour: Tour) -> None:
    action = tour.robot[Following].follow(distance=1.2)
    gaps = await followed(tour, action, 31.0)
    assert action.status is ActionStatus.EXECUTING, action.reason
    assert tour.truth.x > 6.5
    assert min(gaps) > 0.4
    assert not tour.bumps


@pytest.mark.slow  # in short: test_without_anybody_it_gives_up
@pytest.mark.world(BRACELET, body="cyberdog2")
async def test_without_a_connected_tag_it_gives_up(tour: Tour) -> None:
    assert isinstance((await tour.end_of(tour.robot[Following].follow_tag())).error, NotFound)
