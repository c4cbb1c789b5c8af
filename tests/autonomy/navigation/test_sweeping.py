"""Sweeping: how much of the floor the hull really passed over, by the world."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.annotations import Area, AreaKind, MapAnnotations
from roboglot.model.components.motion.sweeping import SweepFeedback, Sweeping
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point, Pose

if TYPE_CHECKING:
    from collections.abc import Sequence

    from tests.autonomy.conftest import Tour

pytestmark = pytest.mark.world("empty")
WEST, EAST, SOUTH, NORTH = 4.0, 7.0, 3.4, 5.6
STONE = (5.5, 4.5, 0.6)  # middle and side


@pytest.mark.slow  # a long story
async def test_a_coverage_area_around_an_obstacle_is_swept(tour: Tour) -> None:
    tour.world.stage.add_obstacle(Pose(*STONE[:2], 0.0), (STONE[2], STONE[2], 1.0))
    for spot in ((5.5, 3.0), (7.3, 4.5), (5.5, 6.0)):  # seen from all sides
        await tour.go(spot)
    middle = (SOUTH + NORTH) / 2
    area = Area(0, AreaKind.COVERAGE, tour.on_map(WEST, middle), tour.on_map(EAST, middle), (NORTH - SOUTH) / 2)
    with pytest.raises(InvalidGoal):
        tour.robot[Sweeping].sweep()
    await tour.robot[MapAnnotations].change(lambda now: now.with_new(area))
    ways = await tour.robot[Sweeping].lanes()
    assert 2 <= len(ways) <= 5  # in front of, beside and behind the stone, not specks
    action, track = tour.robot[Sweeping].sweep(), []
    while not action.status.ended:
        await tour.clock.advance(0.1)
        track.append((tour.truth.x, tour.truth.y))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert isinstance(action.feedback, SweepFeedback)
    assert action.feedback.left_out == 0.0
    assert action.feedback.done == pytest.approx(action.feedback.total)
    assert not tour.bumps
    radius, gap = tour.robot.description.radius, STONE[2] / 2 + 0.1
    spots = [(x, y) for x in np.arange(WEST, EAST, 0.1) for y in np.arange(SOUTH, NORTH, 0.1)
             if max(abs(x - STONE[0]), abs(y - STONE[1])) > gap]  # fmt: skip
    near = np.array([np.hypot(*(np.array(track) - spot).T).min() for spot in spots])
    assert np.mean(near < radius + 0.02) > 0.95


async def test_nonsense_is_refused(tour: Tour) -> None:
    area = Area(0, AreaKind.COVERAGE, Point(0, 0), Point(1, 0), 1.0)
    nowhere = Area(0, AreaKind.COVERAGE, Point(float("nan"), 0), Point(1, 0), 1.0)
    for areas, width in (((), None), ((area,), 0.0), ((area,), float("nan")), ((nowhere,), None)):
        with pytest.raises(InvalidGoal):
            tour.robot[Sweeping].sweep(areas, width=width)


async def test_area_beyond_map_is_swept_on_map(tour: Tour) -> None:
    """A client may draw an area of any size: the lanes end with the map, and lie no farther apart."""
    whole, vast = (Area(0, AreaKind.COVERAGE, Point(-far, 0.0), Point(far, 0.0), far) for far in (15.0, 1500.0))
    sweeping = tour.robot[Sweeping]
    ways = await sweeping.lanes((vast,), width=0.5)
    swept, expected = (sum(_lengths(them)) for them in (ways, await sweeping.lanes((whole,), width=0.5)))
    assert swept == pytest.approx(expected, rel=0.1)
    assert swept > 10.0
    beside = sorted({round(way[k].y, 2) for way in ways for k in range(0, len(way), 2)})
    assert max(np.diff(beside)) <= 0.51
    with pytest.raises(InvalidGoal, match="2000"):
        await sweeping.lanes((vast,) * 100, width=0.1)


def _lengths(ways: Sequence[Sequence[Point]]) -> list[float]:
    return [way[k].distance_to(way[k + 1]) for way in ways for k in range(0, len(way), 2)]
