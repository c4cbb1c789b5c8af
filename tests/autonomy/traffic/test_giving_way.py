"""Going aside for others: what comes after it is looked at as well, and no two do it in step for ever."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import pytest

from roboglot.autonomy.navigation.replanner import Replanner
from roboglot.autonomy.navigation.route import Route
from roboglot.autonomy.traffic.giving_way import FACED_MAX, GivingWay, chance
from roboglot.model.geometry import Pose

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


@pytest.mark.world("empty")
async def test_looks_ahead_after_going_aside(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let it give way, find no route, go aside once more, and find one."""
    asked, first, plans = dict.fromkeys(("is_due", "is_due_without_route"), 0), Replanner.first, 0

    def once(name: str) -> None:
        def due(*_: object) -> bool:
            asked[name] += 1
            return asked[name] == (20 if name == "is_due" else 1)

        monkeypatch.setattr(GivingWay, name, due)

    async def none_at_second(self: Replanner) -> Route | None:
        nonlocal plans
        plans += 1
        return None if plans == 2 else await first(self)

    once("is_due")
    once("is_due_without_route")
    monkeypatch.setattr(Replanner, "first", none_at_second)
    goal = Pose(tour.start.x + 3.5, tour.start.y)
    tour.head_for((goal.x, goal.y))
    await tour.until(lambda: plans == 3, 30.0)
    assert asked["is_due_without_route"] == 1
    tour.world.stage.add_obstacle(Pose(tour.truth.x + 1.2, tour.truth.y))
    await tour.clock.advance(6.0)
    assert not tour.bumps
    assert tour.blocks


def test_two_go_aside_at_different_times() -> None:
    for one, other in combinations([f"r{n}" for n in range(10)], 2):
        apart = [abs(chance(one, times) - chance(other, times)) for times in range(FACED_MAX)]
        assert sum(gap > 0.25 for gap in apart) >= 2, (one, other)
