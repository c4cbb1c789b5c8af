"""Loading maps and moving their origin, judged by the world."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.autonomy.slam.grid_import import evidence_of
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import MapReplaced, PoseJumped
from roboglot.model.geometry import Point, Pose
from roboglot.model.maps import OccupancyGrid

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour


def test_grid_on_the_same_cells_comes_back_unchanged() -> None:
    cells = np.array([[0, -127, 127], [1, -1, 5], [-90, 0, 126]], np.int8)
    grid = OccupancyGrid(cells, 0.05, Point(-1.5, 2.05))
    again = evidence_of(grid).occupancy()
    assert (again.log_odds == cells).all()
    assert (again.origin.x, again.origin.y) == pytest.approx((-1.5, 2.05))


@pytest.mark.parametrize("resolution", [0.1, 0.025])
def test_other_cell_sizes_are_resampled_without_losing_walls(resolution: float) -> None:
    side = round(2.0 / resolution)
    cells = np.full((side, side), -50, np.int8)
    cells[:, side // 2] = 80  # a wall along y at x = 1 m
    again = evidence_of(OccupancyGrid(cells, resolution, Point())).occupancy()
    assert (again.height, again.width) == (40, 40)
    assert (again.log_odds[:, 20] == 80).all()
    assert (again.log_odds[:, :20] == -50).all()


@pytest.mark.parametrize("resolution", [0.0499, 0.033, 0.01])
def test_cells_have_their_strongest_wall(resolution: float) -> None:
    cells = np.random.default_rng(1).integers(-127, 127, (41, 33), dtype=np.int8)
    found = evidence_of(OccupancyGrid(cells, resolution, Point())).occupancy().log_odds
    wanted: dict[tuple[int, int], int] = {}
    for (row, column), value in np.ndenumerate(cells):
        at = tuple(
            min(int(n / (0.05 / resolution)), most - 1) for n, most in zip((row, column), found.shape, strict=True)
        )
        before = wanted.get(at, 0)
        wanted[at] = max(before, int(value)) if max(before, int(value)) > 0 else min(before, int(value))
    assert wanted == {at: value for at, value in np.ndenumerate(found) if at in wanted}


def test_grid_without_known_cells_is_an_empty_map() -> None:
    assert evidence_of(OccupancyGrid(np.zeros((9, 9), np.int8), 0.05, Point())).scans == 0


@pytest.mark.parametrize("shape", [(0, 1 << 50), (1 << 50, 0)])
def test_cells_that_are_not_there_take_no_memory(shape: tuple[int, int]) -> None:
    assert evidence_of(OccupancyGrid(np.zeros(shape, np.int8), 0.05, Point())).scans == 0


@pytest.mark.parametrize("resolution", [1e-4, 1e-9, 1e-300])
def test_tiny_maps_are_one_cell(resolution: float) -> None:
    cells = np.array([[-1, 5], [0, -1]], np.int8)
    assert evidence_of(OccupancyGrid(cells, resolution, Point())).occupancy().log_odds.tolist() == [[5]]


@pytest.mark.parametrize("shape", [(1, 9000), (3000, 2800)])
def test_a_map_that_is_too_large_is_refused(shape: tuple[int, int]) -> None:
    cells = np.zeros(shape, np.int8)
    cells[0, 0] = cells[-1, -1] = 1
    with pytest.raises(InvalidGoal):
        evidence_of(OccupancyGrid(cells, 0.05, Point()))


@pytest.mark.slow
async def test_loaded_map_is_driven_on_as_the_original(tour: Tour) -> None:
    await tour.go((22.5, 10.0))
    mapping, localization = tour.robot[Mapping], tour.robot[Localization]
    grid, pose = mapping.grid, localization.pose
    heard = tour.robot.events.subscribe(MapReplaced, PoseJumped)
    mapping.clear()
    await tour.clock.advance(1.0)
    heard.drain()
    mapping.load(grid, Pose(pose.x + 0.2, pose.y - 0.1, pose.yaw + 0.1))  # slightly displaced
    assert [type(event) for event in heard.drain()] == [MapReplaced, PoseJumped]
    assert mapping.grid.log_odds.shape == grid.log_odds.shape
    await tour.clock.advance(2.0)
    assert tour.error[0] < 0.05
    assert tour.error[1] < 1.0
    action = await tour.go((5.0, 10.0))
    assert action.status.name == "SUCCEEDED"
    assert tour.error[0] < 0.06
    assert not tour.bumps


async def test_origin_moves_and_robot_stays_where_it_is(tour: Tour) -> None:
    mapping, localization = tour.robot[Mapping], tour.robot[Localization]
    before, pose = mapping.grid, localization.pose
    moved = mapping.move_origin(Point(1.02, -0.49))
    assert (moved.x, moved.y) == pytest.approx((1.0, -0.5))
    after = mapping.grid
    assert (after.log_odds == before.log_odds).all()
    assert (after.origin.x, after.origin.y) == pytest.approx((before.origin.x - 1.0, before.origin.y + 0.5))
    assert (localization.pose.x, localization.pose.y) == pytest.approx((pose.x - 1.0, pose.y + 0.5))
    await tour.clock.advance(2.0)
    assert (localization.pose.x, localization.pose.y) == pytest.approx((pose.x - 1.0, pose.y + 0.5), abs=0.02)
    with pytest.raises(InvalidGoal):
        mapping.move_origin(Point(math.nan, 0.0))
