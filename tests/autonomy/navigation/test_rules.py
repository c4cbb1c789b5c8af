"""Annotations of the map that drives obey: by the world's truth."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import pytest

from roboglot.autonomy.navigation import drive_progress
from roboglot.autonomy.navigation.pilot_tuning import PilotTuning
from roboglot.model.actions import Action, ActionStatus
from roboglot.model.components.mapping.annotations import (
    Area,
    AreaKind,
    Line,
    LineKind,
    MapAnnotations,
)
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.navigation import Tracks
from roboglot.model.errors import Unreachable
from roboglot.model.events import RobotBlocked
from roboglot.model.geometry import Point, Pose
from roboglot.testing import assert_pose

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

pytestmark = pytest.mark.world("empty")


async def draw(tour: Tour, *entries: Line | Area) -> None:
    """Annotations given in the world."""
    placed = [placed_in(tour, entry) for entry in entries]
    await tour.robot[MapAnnotations].change(lambda now: now.with_new(*placed))


def placed_in(tour: Tour, entry: Line | Area) -> Line | Area:
    """Return the entry in the robot's map."""
    start, end = tour.on_map(entry.start.x, entry.start.y), tour.on_map(entry.end.x, entry.end.y)
    if isinstance(entry, Line) and entry.control:
        first, second = (tour.on_map(p.x, p.y) for p in entry.control)
        return replace(entry, start=start, end=end, control=(first, second))
    return replace(entry, start=start, end=end)


def wall(x0: float, y0: float, x1: float, y1: float) -> Line:
    return Line(0, LineKind.WALL, Point(x0, y0), Point(x1, y1))


def track(x0: float, y0: float, x1: float, y1: float, *control: tuple[float, float]) -> Line:
    bent = (Point(*control[0]), Point(*control[1])) if control else None
    return Line(0, LineKind.TRACK, Point(x0, y0), Point(x1, y1), bent)


def area(kind: AreaKind, x: float, y: float, half: float, speed_max: float | None = None) -> Area:
    return Area(0, kind, Point(x - half, y), Point(x + half, y), half, speed_max=speed_max)


async def watched(tour: Tour, action: Action) -> list[Pose]:
    """Return the robot's true poses to the end of the action."""
    seen = []
    while not action.status.ended:
        await tour.clock.advance(0.1)
        seen.append(tour.truth)
    return seen


@pytest.mark.slow  # in short: test_a_wall_is_gone_around
async def test_a_virtual_wall_is_driven_around(tour: Tour) -> None:
    await draw(tour, wall(5.0, 0.0, 5.0, 7.5))
    action = tour.head_for((8.0, 4.0))
    places = await watched(tour, action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    crossing = next(pose for pose in places if pose.x > 5.0)
    assert crossing.y > 7.5 + tour.robot.description.radius
    assert not tour.blocks


async def test_virtual_wall_drawn_underway_makes_the_goal_unreachable(tour: Tour) -> None:
    fence = [wall(7, 3, 9, 3), wall(9, 3, 9, 5), wall(9, 5, 7, 5), wall(7, 5, 7, 3)]
    action = tour.head_for((8.0, 4.0))
    await tour.until(lambda: tour.truth.x > 3.0)
    assert action.status is ActionStatus.EXECUTING
    await draw(tour, *fence)
    await tour.end_of(action, 5.0)
    assert isinstance(action.error, Unreachable)
    assert isinstance((await tour.go((8.0, 4.0))).error, Unreachable)


async def test_forbidden_areas_may_be_left_but_not_entered(tour: Tour) -> None:
    await draw(tour, area(AreaKind.FORBIDDEN, 5.0, 5.0, 1.5))
    action = tour.head_for((8.5, 5.0))
    places = await watched(tour, action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    radius = tour.robot.description.radius
    assert all(max(abs(p.x - 5.0), abs(p.y - 5.0)) > 1.5 + radius - 0.03 for p in places)
    assert isinstance((await tour.go((5.0, 5.0))).error, Unreachable)
    tour.world.stage.place("a", Pose(5.6, 5.0, 0.0))
    tour.robot[Localization].set_pose(Pose(5.6, 5.0, 0.0).relative_to(tour.start))
    action = await tour.go((8.5, 5.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(tour.truth, x=8.5, y=5.0)


@pytest.mark.slow  # in short: test_a_dangerous_area_is_crossed_slowly
async def test_dangerous_areas_are_passed_slowly(tour: Tour) -> None:
    await draw(tour, area(AreaKind.DANGEROUS, 5.0, 5.0, 1.5, speed_max=0.2))
    action, inside, outside = tour.head_for((8.5, 5.0)), 0.0, 0.0
    while not action.status.ended:
        await tour.clock.advance(0.1)
        speed = tour.robot[Base].velocity.speed
        if abs(tour.truth.x - 5.0) < 1.4:
            inside = max(inside, speed)
        else:
            outside = max(outside, speed)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert 0.1 < inside < 0.25
    assert outside > 0.6


@pytest.mark.parametrize("mode", [Tracks.STRICT, pytest.param(Tracks.PREFERRED, marks=pytest.mark.slow)])
async def test_tracks_are_followed_around_bends(tour: Tour, mode: Tracks) -> None:
    await draw(tour, track(1.5, 5.0, 8.5, 5.0, (1.5, 9.5), (8.5, 9.5)))  # an arc whose top is at y = 8.375
    await tour.go((1.6, 5.0))
    action = tour.head_for((8.5, 5.0), tracks=mode)
    places = await watched(tour, action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert max(pose.y for pose in places) > 8.1
    assert_pose(tour.truth, x=8.5, y=5.0)


async def test_free_navigation_ignores_tracks(tour: Tour) -> None:
    await draw(tour, track(1.5, 5.0, 8.5, 5.0, (1.5, 9.5), (8.5, 9.5)))
    places = await watched(tour, tour.head_for((8.5, 5.0)))
    assert max(abs(pose.y - 5.0) for pose in places) < 1.0


@pytest.mark.slow  # in short: test_tracks_are_followed_around_bends
async def test_waits_on_strict_tracks_reporting_after_three_minutes(
    tour: Tour, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert drive_progress.BLOCKED_SECONDS == 180.0  # docs/autonomy.md gives the default; shorter here
    monkeypatch.setattr(drive_progress, "BLOCKED_SECONDS", PilotTuning().patience + 15.0)
    await draw(tour, track(1.5, 5.0, 8.5, 5.0))
    reported: list[RobotBlocked] = []
    tour.robot.events.listen(RobotBlocked, reported.append)
    action = tour.head_for((8.5, 5.0), tracks=Tracks.STRICT)
    await tour.until(lambda: tour.truth.x > 3.0)
    stone = tour.world.stage.add_obstacle(Pose(6.0, 5.0, 0.0), (0.5, 0.5, 1.0))
    await tour.clock.advance(PilotTuning().patience + 5.0)
    assert action.status is ActionStatus.EXECUTING
    assert tour.blocks
    assert not reported
    await tour.clock.advance(20.0)
    assert [event.action for event in reported] == [action]
    tour.world.stage.remove_obstacle(stone)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert len(reported) == 1
    assert math.isclose(reported[0].seconds, drive_progress.BLOCKED_SECONDS, abs_tol=2.0)


async def test_in_maintenance_the_map_changes_only_there(tour: Tour) -> None:
    await tour.clock.advance(2.0)
    await draw(tour, area(AreaKind.MAINTENANCE, 4.0, 5.0, 1.0))
    tour.world.stage.add_obstacle(Pose(6.0, 6.15, 0.0), (0.4, 0.4, 1.0))
    await tour.clock.advance(8.0)
    grid = tour.robot[Mapping].grid

    def occupied(x: float, y: float) -> bool:
        row, column = grid.cell_of(tour.on_map(x, y))
        return bool((grid.log_odds[row - 5 : row + 6, column - 5 : column + 6] > 0).any())

    assert not occupied(6.0, 6.15)
    tour.world.stage.add_obstacle(Pose(4.2, 5.4, 0.0), (0.4, 0.4, 1.0))
    await tour.clock.advance(8.0)
    grid = tour.robot[Mapping].grid
    assert occupied(4.2, 5.4)
