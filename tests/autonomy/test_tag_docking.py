"""Docking at printed tags, boards, reflectors and shelves, and away again, measured in the world."""

import math
from pathlib import Path

import pytest

from roboglot.model.components.logistics.jack import Jack
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.tag_docking import Mark, MarkGoal, TagDocking
from roboglot.model.errors import Blocked, InvalidGoal, NotFound
from roboglot.model.geometry import Point, Pose, wrap_angle

WORLD = str(Path(__file__).with_name("worlds") / "marks.toml")


def start(tour, x, y, degrees):
    return Pose(x, y, math.radians(degrees)).relative_to(tour.start)


def off(tour, wanted):
    """Return the robot's distance from there: m, degrees."""
    return tour.truth.distance_to(wanted), abs(math.degrees(wrap_angle(tour.truth.yaw - wanted.yaw)))


async def dock(tour, goal):
    action = await tour.end_of(tour.robot[TagDocking].dock_at(goal, source="test"), 180)
    assert action.reason == ""
    assert not tour.bumps
    return action


@pytest.mark.slow  # in short: test_up_to_it_and_away_again
@pytest.mark.world(WORLD)
@pytest.mark.parametrize("backward", [True, pytest.param(False, marks=pytest.mark.slow)])
async def test_at_a_printed_tag(tour, backward):
    goal = MarkGoal(
        mark=Mark.PRINTED,
        start=start(tour, 7.8, 4.4, 0),
        place=Point(0.6, 0.1),
        texts=frozenset({"12"}),
        backward=backward,
    )
    await dock(tour, goal)
    away, turned = off(tour, Pose(9.4, 3.9, math.pi if backward else 0.0))
    assert away < 0.04
    assert turned < 3.0


@pytest.mark.slow  # in short: test_up_to_it_and_away_again
@pytest.mark.world(WORLD, body="hermes")
async def test_at_a_board_and_off_it(tour):
    await dock(tour, MarkGoal(mark=Mark.BOARD, start=start(tour, 6.8, 2.0, -90)))
    away, turned = off(tour, Pose(7.0, 0.55 + 0.27 + 0.1, -math.pi / 2))
    assert away < 0.03
    assert turned < 3.0
    action = await tour.end_of(tour.robot[TagDocking].back_off(Mark.BOARD, watchful=True))
    assert action.reason == ""
    away, turned = off(tour, Pose(7.0, 0.92 + 0.57, -math.pi / 2))
    assert away < 0.04
    assert turned < 3.0


@pytest.mark.slow  # in short: test_up_to_it_and_away_again
@pytest.mark.world(WORLD, body="hermes")
async def test_at_reflectors(tour):
    goal = MarkGoal(
        mark=Mark.REFLECTORS, start=start(tour, 3.3, 2.0, -90), strips=2, place=Point(0.5), turn=math.pi / 2
    )
    await dock(tour, goal)
    away, turned = off(tour, Pose(3.0, 0.5, 0.0))
    assert away < 0.04
    assert turned < 4.0


@pytest.mark.slow
@pytest.mark.world(WORLD, body="hermes")
async def test_a_shelf_is_lifted_and_set_down(tour):
    (shelf,) = tour.world.building.shelves
    goal = MarkGoal(mark=Mark.SHELF, start=start(tour, 5.6, 6.2, 0), lift=True)
    action = await dock(tour, goal)
    assert off(tour, Pose(7.5, 6.0, 0.0))[0] < 0.03
    assert action.feedback == "docked"
    assert tour.robot[Jack].loaded
    assert shelf.lifted > 0.01
    action = await tour.end_of(tour.robot[TagDocking].back_off(Mark.SHELF, distance=1.2))
    assert action.reason == ""
    assert not tour.robot[Jack].loaded
    assert shelf.lifted == 0.0
    assert shelf.pose.distance_to(Pose(7.5, 6.0)) < 0.02
    assert off(tour, Pose(6.3, 6.0, 0.0))[0] < 0.05


@pytest.mark.slow  # the shelf itself: test_a_shelf_is_lifted_and_set_down
@pytest.mark.world(WORLD, body="hermes")
async def test_a_part_of_the_hull_stays_outside(tour):
    await dock(tour, MarkGoal(mark=Mark.SHELF, start=start(tour, 5.6, 6.0, 0), outside=0.2))
    # 0.2 m of the 0.54 m before the front at 7.05
    assert off(tour, Pose(7.05 - 0.2 + 0.27, 6.0, 0.0))[0] < 0.03


@pytest.mark.slow
@pytest.mark.world(WORLD, body="hermes")
async def test_no_mark_there(tour):
    for mark in (Mark.BOARD, Mark.SHELF, Mark.REFLECTORS, Mark.PRINTED):
        goal = MarkGoal(mark=mark, start=start(tour, 2.0, 4.0, 90))
        action = await tour.end_of(tour.robot[TagDocking].dock_at(goal))
        assert isinstance(action.error, NotFound), mark


@pytest.mark.slow
@pytest.mark.world(WORLD, body="hermes")
async def test_a_tag_of_another_number_is_not_taken(tour):
    goal = MarkGoal(mark=Mark.PRINTED, start=start(tour, 8.0, 4.0, 0), texts=frozenset({"13"}))
    assert isinstance((await tour.end_of(tour.robot[TagDocking].dock_at(goal))).error, NotFound)


@pytest.mark.world(WORLD, body="hermes")
async def test_impossible_goals_are_refused(tour):
    docking = tour.robot[TagDocking]
    for goal in (
        MarkGoal(mark=Mark.BOARD, place=Point(0.2)),
        MarkGoal(mark=Mark.SHELF, outside=1.0),
        MarkGoal(mark=Mark.BOARD, start=Pose(math.nan)),
        MarkGoal(mark=Mark.BOARD, retries=-1),
    ):
        with pytest.raises(InvalidGoal):
            docking.dock_at(goal)
    with pytest.raises(InvalidGoal):
        docking.back_off(Mark.BOARD, distance=0.0)


@pytest.mark.slow
@pytest.mark.world(WORLD, body="hermes")
async def test_held_before_the_mark(tour):
    action = tour.robot[TagDocking].dock_at(MarkGoal(mark=Mark.BOARD, start=start(tour, 7.0, 2.0, -90)))
    await tour.until(lambda: action.feedback == "docking")
    tour.world.faults.inject("blocked_path", "a", ahead=0.4, width=0.2)
    await tour.end_of(action)
    assert isinstance(action.error, Blocked)


@pytest.mark.slow  # long; in short: test_a_shelf_is_lifted_and_set_down
@pytest.mark.world(WORLD, body="hermes")
async def test_a_lifted_shelf_is_carried_elsewhere(tour):
    (shelf,) = tour.world.building.shelves
    await dock(tour, MarkGoal(mark=Mark.SHELF, start=start(tour, 5.6, 6.0, 0), lift=True))
    action = await tour.go((4.5, 2.5), deg=0)
    assert action.reason == ""
    assert tour.error[0] < 0.05
    assert not tour.bumps
    assert shelf.pose.distance_to(Pose(4.5, 2.5)) < 0.1
    await tour.clock.advance(5.0)
    grid = tour.robot[Mapping].grid
    for x, y in ((0.43, 0.43), (0.43, -0.43), (-0.43, 0.43), (-0.43, -0.43)):
        row, column = grid.cell_of(shelf.pose.compose(Pose(x, y)).relative_to(tour.start).point)
        around = grid.log_odds[row - 1 : row + 2, column - 1 : column + 2]
        assert around.max() <= 0  # carried things are left out of the map
    await tour.end_of(tour.robot[TagDocking].back_off(Mark.SHELF, distance=1.0))
    assert not tour.robot[Jack].loaded


@pytest.mark.world("empty", body="hermes")
async def test_backing_off_on_the_dock_moves_or_fails(tour):
    docking = tour.robot[TagDocking]
    held = await tour.end_of(docking.back_off(Mark.PRINTED, distance=0.5))  # the dock is behind the robot
    assert isinstance(held.error, Blocked)
    away = await tour.end_of(docking.back_off(Mark.PRINTED, distance=0.5, ahead=True))
    assert away.reason == ""
    assert tour.truth.distance_to(tour.start) > 0.4
