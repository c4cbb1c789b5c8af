"""A lost robot that stands and sees the same searches its map more and more rarely, and at once when that changes."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.autonomy.slam.belief import SURE
from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.autonomy.slam.matcher import Match
from roboglot.autonomy.slam.recovery import whole_map_search
from roboglot.autonomy.slam.recovery.fruitless_searches import View, nearest_echoes
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.events import LostReason
from roboglot.model.geometry import Point, Pose, Twist
from tests.narrowing import known, of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

pytestmark = pytest.mark.world("empty")
ELSEWHERE = Pose(7.0, 2.0, 1.0)
FURTHER = Pose(6.0, 3.0, 1.0)
STOOD = 20.0  # s: searches after 0, 1, 3, 7 and 15 s


class Searches:
    """The searches of a robot, and what they find."""

    def __init__(self, tour: Tour) -> None:
        self.tour, self.found, self.times = tour, list[list[Match]](), list[float]()

    def places(self, *_: object) -> list[Match]:
        self.times.append(self.tour.clock.time())
        return self.found.pop() if self.found else []

    @property
    def pauses(self) -> list[int]:
        """Return the pauses between them, s."""
        return [round(late - early) for early, late in pairwise(self.times)]

    async def during(self, seconds: float) -> int:
        """Return how many there are."""
        before = len(self.times)
        await self.tour.clock.advance(seconds)
        return len(self.times) - before


def match(x: float) -> Match:
    return Match(Pose(x, 2.0), np.diag(SURE), 0.0, 100, 100, 100)


@pytest.fixture
async def searches(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> Searches:
    """Return those of a robot that was carried off its map."""
    made = Searches(tour)
    monkeypatch.setattr(whole_map_search, "places", made.places)
    await tour.go((2.0, 5.0))  # its dock would tell it the place
    tour.robot[Mapping].enable(False)
    tour.world.stage.place("a", ELSEWHERE)
    estimator = known(of_kind(tour.robot[Localization], LidarLocalization).estimator)
    estimator.whereabouts.lose(LostReason.NO_FIT, tour.clock.time())
    return made


@pytest.mark.parametrize("places", [[], pytest.param([match(20.0), match(30.0)], marks=pytest.mark.slow)])
async def test_fruitless_searches_become_rarer(searches: Searches, places: list[Match]) -> None:
    searches.found = [list(places) for _ in range(100)]
    await searches.during(STOOD)
    assert searches.pauses == [1, 2, 4, 8]


async def test_found_place_is_looked_for_soon(searches: Searches) -> None:
    searches.found = [[match(20.0)], [], []]  # the last one first
    await searches.during(8.0)
    assert searches.pauses == [1, 2, 1, 1, 2]


async def test_carried_robot_searches_again_at_once(searches: Searches) -> None:
    await searches.during(STOOD)
    searches.tour.world.stage.place("a", FURTHER)
    assert await searches.during(2.2) == 2


@pytest.mark.slow  # in short: test_carried_robot_searches_again_at_once
async def test_driving_robot_searches_each_second(searches: Searches) -> None:
    await searches.during(STOOD)
    searches.tour.robot[Driving].drive(Twist(yaw=0.3), source="test")
    assert await searches.during(5.2) == 5


@pytest.mark.slow  # in short: test_carried_robot_searches_again_at_once
async def test_changed_map_is_searched_at_once(searches: Searches) -> None:
    await searches.during(STOOD)
    mapping = searches.tour.robot[Mapping]
    mapping.load(mapping.grid, searches.tour.robot[Localization].pose)
    assert await searches.during(3.0) >= 2


def car(*, draw: int, door: float = 0.0) -> ScanPoints:
    """Return what a robot in a lift's car measures, with noise, whose ``door`` is so far open, m."""
    random, rays = np.random.default_rng(draw), np.linspace(-math.pi, math.pi, 720, endpoint=False)
    ranges = np.minimum(0.8 / np.maximum(1e-9, abs(np.cos(rays))), 0.75 / np.maximum(1e-9, abs(np.sin(rays))))
    ranges[(np.cos(rays) > 0.0) & (abs(0.8 * np.tan(rays)) < door / 2)] = 3.0
    ranges = (ranges + random.normal(0.0, 0.02, len(rays)))[:, None]
    points = (np.stack((np.cos(rays), np.sin(rays)), axis=1) * ranges)[random.random(len(rays)) > 0.05]
    return ScanPoints(points, np.ones(len(points), np.uint8), points, Point())


def seen(scan: ScanPoints) -> View:
    return View(None, 1, Pose(), nearest_echoes(scan))


@pytest.mark.parametrize("draw", range(1, 9))
def test_noise_does_not_change_the_view(draw: int) -> None:
    assert seen(car(draw=draw)).is_like(seen(car(draw=0)))


def test_opening_door_changes_the_view() -> None:
    assert not seen(car(draw=1, door=0.5)).is_like(seen(car(draw=0)))


def test_person_beside_the_robot_changes_the_view() -> None:
    empty = car(draw=0, door=0.9)
    legs = empty.points[(empty.points[:, 0] > 1.0) & (empty.points[:, 1] < 0.0)]
    points = np.concatenate((car(draw=1, door=0.9).points, 0.5 * legs))
    filled = ScanPoints(points, np.ones(len(points), np.uint8), points, Point())
    assert not seen(filled).is_like(seen(empty))
