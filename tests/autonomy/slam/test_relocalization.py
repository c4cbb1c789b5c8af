"""Finding the place in a known map: judged by the world."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.autonomy.slam.belief import SURE
from roboglot.autonomy.slam.localization import LidarLocalization
from roboglot.autonomy.slam.matcher import Match
from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.localization import Localization, Region
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.sensing.lidar import Lidar
from roboglot.model.errors import InvalidGoal, NotLocalized
from roboglot.model.events import LocalizationLost, LocalizationRecovered, LostReason, PoseJumped, RecoveryMeans
from roboglot.model.geometry import Pose
from tests.narrowing import known, of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

LONG_CORRIDOR = str(Path(__file__).parents[3] / "benchmarks" / "worlds" / "corridor.toml")


async def carried(tour: Tour, x: float, y: float, deg: float) -> None:
    """Carry the robot there while its scans are ignored."""
    tour.robot[Mapping].enable(False)
    tour.robot[Localization].enable(False)
    tour.world.stage.place("a", Pose(x, y, math.radians(deg)))
    await tour.clock.advance(0.3)


async def confirmed(*_: object) -> bool:
    """Stand for a newer scan that fits the place, too."""
    return True


@pytest.mark.slow  # in short: test_a_kidnapped_robot_says_so_and_recovers
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


@pytest.mark.slow  # in short: test_a_kidnapped_robot_says_so_and_recovers
@pytest.mark.world("office")
@pytest.mark.parametrize(
    ("x", "y", "deg", "towards"),
    [
        (9.5, 9.7, 30.0, -30.0),
        *(pytest.param(*place, 0.0, marks=pytest.mark.slow) for place in ((20.0, 9.6, 170.0), (13.0, 6.6, -60.0))),
    ],
)
async def test_robot_carried_during_the_search_is_found(
    tour: Tour, x: float, y: float, deg: float, towards: float
) -> None:
    await tour.go((12.0, 9.8))
    await tour.go((12.0, 6.5))
    for turned in (0.0, 100.0, -130.0):
        await carried(tour, x, y, deg + turned)
        action = tour.robot_finds_itself()
        for step in range(1, 9):  # the robot is still in the air when the search begins
            ahead = Pose(x, y, math.radians(towards)).compose(Pose(0.08 * step))
            tour.world.stage.place("a", Pose(ahead.x, ahead.y, math.radians(deg + turned)))
            await tour.clock.advance(0.1)
        await tour.end_of(action)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        assert tour.error[0] < 0.02
        assert tour.error[1] < 1.0


@pytest.mark.world("office")
async def test_a_kidnapped_robot_says_so_and_recovers(tour: Tour) -> None:
    await tour.go((12.0, 9.8))
    await tour.go((12.0, 6.5))
    news: list[LocalizationLost | LocalizationRecovered] = []
    tour.robot.events.listen(LocalizationLost, news.append)
    tour.robot.events.listen(LocalizationRecovered, news.append)
    for x, y, deg in ((20.0, 10.2, 170.0), (13.0, 6.6, -60.0), (9.5, 9.7, 30.0)):
        walls = int((tour.robot[Mapping].grid.log_odds > 0).sum())
        tour.world.stage.place("a", Pose(x, y, math.radians(deg)))
        await tour.clock.advance(5.0)
        lost, found = news[0], news[-1]  # a place accepted too early may be lost again
        assert isinstance(lost, LocalizationLost)
        assert isinstance(found, LocalizationRecovered)
        assert 0.0 <= found.seconds <= found.stamp - lost.stamp + 1e-6
        assert tour.robot[Localization].lost is None
        assert tour.error[0] < 0.05
        assert int((tour.robot[Mapping].grid.log_odds > 0).sum()) < walls + 150  # a scan at a wrong place scores 250
        news.clear()


@pytest.mark.world("empty")
async def test_place_found_everywhere_replaces_a_half_fitting_one(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    await tour.go((2.0, 5.0))  # its dock would tell it the place
    estimator = known(of_kind(tour.robot[Localization], LidarLocalization).estimator)
    found = Match(Pose(3.0, 2.0, 1.0), np.diag(SURE), 0.0, 100, 100, 100)
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: [found])
    estimator.whereabouts.lose(LostReason.NO_FIT, tour.clock.time())  # the believed place still fits
    news: list[LocalizationRecovered] = []
    tour.robot.events.listen(LocalizationRecovered, news.append)
    for _ in range(100):
        await tour.clock.advance(0.02)
        if news:
            break
    assert news[0].means is RecoveryMeans.WHOLE_MAP
    assert tour.robot[Localization].pose.distance_to(found.pose) < 0.01


@pytest.mark.world("empty")
async def test_a_place_found_once_replaces_none(tour: Tour, monkeypatch: pytest.MonkeyPatch) -> None:
    await tour.go((2.0, 5.0))
    estimator = known(of_kind(tour.robot[Localization], LidarLocalization).estimator)
    here = tour.robot[Localization].pose
    found = [[Match(Pose(3.0, 2.0, 1.0), np.diag(SURE), 0.0, 100, 100, 100)]]  # as in a mirror, for a moment
    monkeypatch.setattr(
        "roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: found.pop() if found else []
    )
    estimator.whereabouts.lose(LostReason.NO_FIT, tour.clock.time())
    await tour.clock.advance(3.0)
    assert not found
    assert tour.robot[Localization].lost is None
    assert tour.robot[Localization].pose.distance_to(here) < 0.05


@pytest.mark.world("empty")
@pytest.mark.parametrize(
    ("others", "may_move"),
    [
        ([Pose(7.0, 2.0, 1.0)], False),
        *(pytest.param(others, True, marks=pytest.mark.slow) for others in ([], [Pose(7.0, 2.0, 1.0)])),
    ],
)
async def test_search_succeeds_at_no_place_found_once(
    tour: Tour, monkeypatch: pytest.MonkeyPatch, others: list[Pose], may_move: bool
) -> None:
    """A mirror image fits the newest scans for a moment, and perhaps another one after it."""
    await tour.go((2.0, 5.0))
    here = tour.robot[Localization].pose
    found = [[Match(pose, np.diag(SURE), 0.0, 100, 100, 100)] for pose in (*others, Pose(3.0, 2.0, 1.0))]
    monkeypatch.setattr("roboglot.autonomy.slam.slam.places", lambda *_, **__: found.pop() if found else [])
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.look_around.settle", confirmed)
    action = await tour.end_of(tour.robot[Localization].relocalize(may_move=may_move))
    assert not found
    assert (action.status, type(action.error)) == (ActionStatus.ABORTED, NotLocalized)
    assert may_move or tour.robot[Localization].pose.distance_to(here) < 0.05


@pytest.mark.world("empty")
@pytest.mark.parametrize(("x", "lost"), [(3.0, LostReason.AMBIGUOUS), (1.0, None)])
async def test_robot_stays_lost_while_only_other_places_fit(
    tour: Tour, monkeypatch: pytest.MonkeyPatch, x: float, lost: LostReason | None
) -> None:
    await tour.go((2.0, 5.0))
    estimator = known(of_kind(tour.robot[Localization], LidarLocalization).estimator)
    here = tour.robot[Localization].pose
    found = [Match(Pose(here.x + away, here.y, 0.0), np.diag(SURE), 0.0, 100, 100, 100) for away in (x, 4.0)]
    monkeypatch.setattr("roboglot.autonomy.slam.recovery.whole_map_search.places", lambda *_: found)
    estimator.whereabouts.lose(LostReason.NO_FIT, tour.clock.time())  # the believed place still fits
    await tour.clock.advance(3.0)
    assert tour.robot[Localization].lost is lost
    found.clear()  # people may have hidden the true place from the search
    await tour.clock.advance(5.0)
    assert tour.robot[Localization].lost is None


@pytest.mark.slow  # in short: test_robot_stays_lost_while_only_other_places_fit
@pytest.mark.world("empty")
async def test_lost_robot_keeps_saying_that_places_look_alike(tour: Tour) -> None:
    await tour.go((8.5, 5.0))
    tour.world.stage.place("a", Pose(5.6, 5.0))
    await tour.clock.advance(4.0)
    for _ in range(15):
        assert tour.robot[Localization].lost is LostReason.AMBIGUOUS
        await tour.clock.advance(0.1)


@pytest.mark.slow  # in short: test_a_place_found_once_replaces_none
@pytest.mark.world("office")
@pytest.mark.parametrize("along", [0.8, pytest.param(-1.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("x", [16.0, pytest.param(25.0, marks=pytest.mark.slow)])
async def test_place_a_metre_along_corridors_is_found(tour: Tour, x: float, along: float) -> None:
    await tour.go((26.0, 10.0))
    await tour.go((x, 10.0), deg=180)
    await tour.clock.advance(2.0)
    tour.robot[Localization].set_pose(Pose(x + along, 10.0, math.pi).relative_to(tour.start))
    await tour.clock.advance(3.0)
    assert tour.error[0] < 0.05
    tour.world.stage.place("a", Pose(x + along, 10.0, math.pi))
    await tour.clock.advance(6.0)
    assert tour.error[0] < 0.05 or tour.robot[Localization].lost


@pytest.mark.slow  # in short: test_no_region_is_refused
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


@pytest.mark.slow  # one thing hides less: test_a_robot_carried_elsewhere_finds_itself
@pytest.mark.world("office")
async def test_people_around_robot_do_not_hide_its_place(tour: Tour) -> None:
    from roboglot.autonomy.slam.matcher import places
    from roboglot.autonomy.slam.scan_points import ScanReader

    await tour.go((19.0, 9.8))
    await tour.go((19.0, 7.0))  # a room where no person walks
    estimator = known(of_kind(tour.robot[Localization], LidarLocalization).estimator)
    scan = known(tour.robot[Lidar].scan)
    ranges, angles = scan.ranges.copy(), scan.angles
    for bearing, width, away in ((0.0, 0.6, 0.5), (2.0, 0.2, 1.2)):  # one right in front, one farther away
        ranges[abs(angles - bearing) < width] = away
    hidden = ScanReader().read(replace(scan, ranges=ranges))
    (found,) = places(estimator._belief.map, hidden, None)
    assert found.pose.distance_to(tour.truth.relative_to(tour.start)) < 0.05


@pytest.mark.parametrize(("wide", "count"), [(0.6, 1), (1.2, 2), (2.2, 3), (3.0, None)])
def test_people_who_stand_side_by_side_count_each(wide: float, count: int | None) -> None:
    from roboglot.autonomy.slam.certainty import _count, _things

    row = np.stack([np.full(100, 1.5), np.linspace(-wide / 2, wide / 2, 100)], axis=1)
    assert [_count(row, thing) for thing in _things(row, np.arange(100))] == ([] if count is None else [count])


@pytest.mark.slow  # the rule: test_places_are_ruled_out_by_expected_positions
@pytest.mark.world(LONG_CORRIDOR)
async def test_robot_looks_around_until_one_place_is_left(tour: Tour) -> None:
    await tour.go((tour.start.x + 25.0, tour.start.y))
    await carried(tour, tour.start.x + 12.0, tour.start.y, 90.0)
    standing = await tour.end_of(tour.robot[Localization].relocalize())
    assert isinstance(standing.error, NotLocalized)
    assert "look" in standing.reason
    driving = await tour.end_of(tour.robot[Localization].relocalize(may_move=True))
    assert driving.status is ActionStatus.SUCCEEDED, driving.reason
    assert tour.error[0] < 0.1
    assert not tour.bumps


def test_places_are_ruled_out_by_expected_positions() -> None:
    from roboglot.autonomy.slam.matcher import Match
    from roboglot.autonomy.slam.recovery.look_around import Hypotheses

    def at(x: float, y: float) -> Match:
        return Match(Pose(x, y), np.eye(3), 0.0, 100, 100, 100)

    known = Hypotheses()
    assert known.narrow([at(0.0, 0.0), at(10.0, 0.0), at(20.0, 0.0)], Pose()) is None
    assert known.narrow([at(1.0, 0.0), at(11.0, 0.0), at(25.0, 0.0)], Pose(1.0)) is None  # 20 is out, 25 never was in
    last = known.narrow([at(2.0, 0.0), at(26.0, 0.0)], Pose(2.0))
    assert last is not None
    assert last.pose == Pose(2.0)
    assert known.narrow([at(7.0, 7.0), at(9.0, 9.0)], Pose(3.0)) is None  # all were wrong: start over
    assert len(known.places) == 2
