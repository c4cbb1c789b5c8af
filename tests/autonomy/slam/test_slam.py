"""Localization and mapping on the simulated robot, judged by the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import LocalizationLost, LocalizationRecovered, LostReason, MapReplaced, PoseJumped
from roboglot.model.geometry import Point, Pose, Twist
from roboglot.model.maps import OccupancyGrid
from tests.masking import mask_bumper

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


@pytest.mark.slow  # in short: test_goals_are_reached_within_5_cm_2_degrees
@pytest.mark.world("office", seed=5)
async def test_office_tour_keeps_within_3_cm_1_degree(tour: Tour) -> None:
    errors = []
    for spot in ((22.5, 10.0), (5.0, 10.0), (5.0, 6.0), (5.0, 10.0), (20.5, 10.0), (20.5, 13.0)):
        action = tour.head_for(spot)
        while not action.status.ended:
            await tour.clock.advance(0.5)
            errors.append(tour.error)
    worst, worst_deg = (max(column) for column in zip(*errors, strict=True))
    assert worst < 0.03
    assert worst_deg < 1.0
    assert tour.robot[Localization].quality > 0.85
    drift = tour.start.compose(tour.robot[Odometry].reading.pose).distance_to(tour.truth)
    assert drift > 0.05  # otherwise the test proves nothing
    _assert_map_agrees(tour)


def _assert_map_agrees(tour: Tour) -> None:
    """Occupied cells lie at the walls of the corridor where only walls are; its middle is free."""
    grid = tour.robot[Mapping].grid
    south = [(x, 8.56) for x in np.arange(13.5, 18.0, 0.1)]
    north = [(x, 11.44) for x in np.arange(17.0, 19.5, 0.1)]
    hits = [_near(grid, tour.on_map(x, y)) for x, y in south + north]
    assert np.mean(hits) > 0.95
    middle = [grid.log_odds[grid.cell_of(tour.on_map(x, y))] for x in np.arange(4.0, 26.0, 0.1) for y in (9.9, 10.1)]
    assert np.mean(np.array(middle) < 0) > 0.97


def _near(grid: OccupancyGrid, point: Point) -> bool:
    """Return whether a cell at ``point`` or beside it is occupied."""
    row, column = grid.cell_of(point)
    return bool((grid.log_odds[row - 1 : row + 2, column - 1 : column + 2] > 0).any())


@pytest.mark.world("empty")
async def test_the_map_begins_where_the_robot_woke_up(tour: Tour) -> None:
    grid = tour.robot[Mapping].grid
    assert grid.resolution == 0.05
    assert grid.log_odds.dtype == np.int8
    assert grid.log_odds[grid.cell_of(Point(0.3, 0.0))] < 0
    assert _near(grid, tour.on_map(9.97, 5.0))
    assert not tour.robot[Localization].pose.distance_to(Point()) > 0.005


@pytest.mark.world("empty")
async def test_a_frozen_map_stays_and_localizes(tour: Tour) -> None:
    mapping = tour.robot[Mapping]
    await tour.go((5.0, 5.0))
    mapping.enable(False)
    before, revision = mapping.grid, mapping.revision
    tour.world.stage.add_obstacle(Pose(8.0, 8.0, 0.0), (1.0, 1.0, 1.0))
    await tour.go((3.0, 3.0))
    assert mapping.revision == revision
    np.testing.assert_array_equal(mapping.grid.log_odds, before.log_odds)
    assert tour.error[0] < 0.03
    mapping.enable(True)
    await tour.clock.advance(3.0)
    assert mapping.revision > revision


@pytest.mark.world("empty")
async def test_the_revision_stands_for_what_the_grid_shows(tour: Tour) -> None:
    mapping = tour.robot[Mapping]
    first, revision = mapping.grid, mapping.revision
    assert mapping.grid is first
    await tour.clock.advance(2.5)
    assert mapping.revision > revision
    assert mapping.grid is not first


@pytest.mark.world("office")
async def test_rough_pose_is_corrected_a_wrong_one_reported(tour: Tour) -> None:
    await tour.go((20.0, 10.0))
    localization, jumps = tour.robot[Localization], []
    tour.robot.events.listen(PoseJumped, jumps.append)
    right = localization.pose
    localization.set_pose(right.compose(Pose(0.35, -0.3, 0.25)))
    assert jumps[0].pose.distance_to(localization.pose) < 1e-9
    await tour.clock.advance(1.0)
    assert tour.error[0] < 0.03
    assert localization.quality > 0.85
    revision = tour.robot[Mapping].revision
    wrong = right.compose(Pose(3.0, 1.7, 1.0))
    lost, found = [], []
    tour.robot.events.listen(LocalizationLost, lambda event: lost.append((event, tour.robot[Mapping].revision)))
    tour.robot.events.listen(LocalizationRecovered, found.append)
    localization.set_pose(wrong)
    await tour.until(lambda: lost, 3.0)
    assert lost[0][0].reason is LostReason.NO_FIT
    assert lost[0][1] == revision  # a lost robot does not damage its map
    await tour.until(lambda: found, 5.0)
    assert localization.lost is None
    assert tour.error[0] < 0.03


@pytest.mark.world("empty")
async def test_without_correction_the_pose_is_odometry(tour: Tour) -> None:
    localization, odometry = tour.robot[Localization], tour.robot[Odometry]
    localization.enable(False)
    offset = localization.pose.compose(odometry.reading.pose.inverse())
    await tour.end_of(tour.robot[Driving].move_by(Pose(3.0, 0.0, 1.0)))
    assert localization.pose.distance_to(offset.compose(odometry.reading.pose)) < 1e-9
    assert not localization.enabled
    localization.enable(True)
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.03


@pytest.mark.slow
@pytest.mark.world("empty")
async def test_spinning_wheels_do_not_carry_the_pose_away(tour: Tour) -> None:
    await tour.go((7.0, 5.0))
    mask_bumper(tour.robot)
    tour.robot[Driving].drive(Twist(x=1.0), lifetime=6.0)  # against the wall
    await tour.clock.advance(7.0)
    odometry = tour.start.compose(tour.robot[Odometry].reading.pose)
    assert odometry.distance_to(tour.truth) > 1.0
    assert tour.error[0] < 0.05


@pytest.mark.world("empty")
async def test_someone_who_stood_there_is_forgotten(tour: Tour) -> None:
    box = tour.world.stage.add_obstacle(Pose(5.0, 5.0, 0.0), (0.4, 0.4, 1.7))
    await tour.clock.advance(4.0)
    mapping = tour.robot[Mapping]
    assert _near(mapping.grid, tour.on_map(4.8, 5.0))
    tour.world.stage.remove_obstacle(box)
    await tour.clock.advance(20.0)
    grid = mapping.grid
    row, column = grid.cell_of(tour.on_map(5.0, 5.0))
    assert not (grid.log_odds[row - 10 : row + 10, column - 10 : column + 10] > 0).any()


@pytest.mark.world("empty")
async def test_clearing_begins_a_new_map_here(tour: Tour) -> None:
    await tour.end_of(tour.robot[Driving].move_by(Pose(3.0, 1.0, 1.0)))
    replaced: list[MapReplaced] = []
    tour.robot.events.listen(MapReplaced, replaced.append)
    before, revision = tour.robot[Localization].pose, tour.robot[Mapping].revision
    tour.robot[Mapping].clear()
    assert tour.robot[Localization].pose.distance_to(Point()) < 1e-9
    assert replaced[0].origin == before
    assert tour.robot[Mapping].revision > revision
    assert tour.robot[Mapping].grid.width == 0
    await tour.clock.advance(1.0)
    assert tour.robot[Mapping].grid.width > 100


@pytest.mark.world("office")
@pytest.mark.parametrize("clears", [True, False], ids=["cleared", "origin moved"])
async def test_no_pose_of_old_frame_contradicts_new_one(tour: Tour, clears: bool) -> None:
    """In a corridor a scan fits many poses, among them those believed a moment ago, on the map before."""
    localization, mapping = tour.robot[Localization], tour.robot[Mapping]
    await tour.clock.advance(1.0)
    tour.head_for((20.0, 10.0))
    await tour.until(lambda: localization.pose.distance_to(Point()) > 0.4)
    if clears:
        mapping.clear()
    else:
        mapping.move_origin(Point(0.5, 0.0))
    believed, true = localization.pose, tour.truth
    for _ in range(4):
        await tour.clock.advance(0.1)
        assert localization.pose.relative_to(believed).distance_to(tour.truth.relative_to(true)) < 0.05


@pytest.mark.world("empty")
async def test_nonsense_poses_are_refused(tour: Tour) -> None:
    for pose in (Pose(math.nan, 0.0, 0.0), Pose(0.0, math.inf, 0.0), Pose(0.0, 0.0, math.nan), Pose(1e9, 0.0, 0.0)):
        with pytest.raises(InvalidGoal):
            tour.robot[Localization].set_pose(pose)
    assert tour.robot[Localization].pose.distance_to(Point()) < 0.01


@pytest.mark.world("office")
async def test_a_robot_that_was_pushed_aside_finds_itself(tour: Tour) -> None:
    await tour.go((20.0, 10.0))
    tour.world.stage.place("a", tour.truth.compose(Pose(0.1, 0.15, math.radians(4.0))))
    assert tour.error[0] > 0.15  # odometry noticed nothing
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.03
    assert tour.error[1] < 1.0
