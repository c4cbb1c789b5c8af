"""Doors: where a robot got in, it gets out; who stands in the only one is waited for; narrow ones are reported."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.errors import Blocked, Unreachable
from roboglot.model.geometry import Pose, Twist
from tests.narrowing import of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

NARROW = str(Path(__file__).parents[1] / "worlds" / "narrow_door.toml")
WIDE = str(Path(__file__).parents[1] / "worlds" / "wide_door.toml")
PERSON = (0.4, 0.4, 1.7)


@pytest.mark.slow
@pytest.mark.world(NARROW)
async def test_robot_leaves_by_the_door_it_entered(tour: Tour) -> None:
    await tour.clock.advance(1.5)
    for spot in ((6.0, 3.3), (2.0, 3.0), (6.0, 2.5), (2.0, 3.0)):
        action = await tour.go(spot)
        assert action.status is ActionStatus.SUCCEEDED, (spot, action.reason)


@pytest.mark.slow  # in short: test_robot_leaves_by_the_door_it_entered
@pytest.mark.world(NARROW, seed=2)
async def test_it_gets_through_at_a_slant(tour: Tour) -> None:
    await tour.clock.advance(1.5)
    for spot in ((5.2, 3.3), (2.8, 3.0), (5.2, 2.7), (2.6, 2.4), (4.6, 3.6)):
        begun = tour.clock.time()
        action = await tour.go(spot)
        assert action.status is ActionStatus.SUCCEEDED, (spot, action.reason)
        assert tour.clock.time() - begun < 20.0
    assert not tour.bumps


@pytest.mark.slow  # half a minute; test_too_wide_robot_reports_the_door_width
@pytest.mark.world(WIDE)
async def test_too_narrow_gap_ends_drive_and_is_reported(tour: Tour) -> None:
    """The map has a door of 0.9 m; two boxes that stand in it when the robot is close leave 0.48 m."""
    await tour.go((6.0, 3.0))
    await tour.go((2.0, 3.0))
    for side in (-1.0, 1.0):
        tour.world.stage.add_obstacle(Pose(4.0, 3.0 + 0.34 * side), (0.2, 0.2, 1.0))
    begun = tour.clock.time()
    action = await tour.go((6.0, 3.0))
    assert isinstance(action.error, Blocked | Unreachable)
    assert tour.clock.time() - begun < 45.0


@pytest.mark.slow
@pytest.mark.world(NARROW)
async def test_gets_out_where_it_was_steered_by_hand(tour: Tour) -> None:
    tour.robot[Driving].drive(Twist(x=0.3), lifetime=19.0)
    await tour.clock.advance(40.0)  # by now the map shows it thicker
    assert tour.truth.x > 5.0
    action = await tour.go((2.0, 3.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason


@pytest.mark.world(NARROW, body="hermes")
async def test_too_wide_robot_reports_the_door_width(tour: Tour) -> None:
    await tour.clock.advance(1.5)
    action = await tour.go((6.0, 3.3))
    assert isinstance(action.error, Unreachable)
    assert "0.64 m are needed" in action.reason
    width = float(action.reason.split("about ")[1].split()[0])
    assert 0.45 <= width <= 0.64


@pytest.mark.slow
@pytest.mark.world(WIDE)
async def test_person_in_the_only_door_is_waited_for(tour: Tour) -> None:
    person = tour.world.stage.add_obstacle(Pose(4.0, 3.0, 0.0), PERSON)
    await tour.clock.advance(30.0)  # long enough for a pillar to appear on the map
    action = tour.head_for((6.0, 3.0))
    await tour.clock.advance(10.0)
    assert action.status is ActionStatus.EXECUTING, action.reason
    assert of_kind(action.feedback, NavigationFeedback).stage == "waiting"
    assert tour.blocks
    tour.world.stage.remove_obstacle(person)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert not tour.bumps


@pytest.mark.slow  # in short: test_person_in_the_only_door_is_waited_for
@pytest.mark.world(WIDE)
async def test_person_who_stays_in_only_door_is_reported(tour: Tour) -> None:
    tour.world.stage.add_obstacle(Pose(4.0, 3.0, 0.0), PERSON)
    await tour.clock.advance(30.0)
    begun = tour.clock.time()
    action = await tour.go((6.0, 3.0))
    assert isinstance(action.error, Blocked)
    assert 29.0 < tour.clock.time() - begun < 36.0


@pytest.mark.world("office", body="cyberdog2")
async def test_goal_off_the_map_is_refused_at_once(tour: Tour) -> None:
    await tour.clock.advance(2.0)
    begun = tour.clock.time()
    action = await tour.go((70.0, 7.0))
    assert isinstance(action.error, Unreachable)
    assert tour.clock.time() - begun < 1.0


@pytest.mark.slow
@pytest.mark.world("office", body="cyberdog2")
async def test_goal_in_wall_met_on_way_is_unreachable(tour: Tour) -> None:
    await tour.clock.advance(2.0)
    begun = tour.clock.time()
    action = await tour.go((29.95, 7.0))  # the wall is not mapped yet
    assert isinstance(action.error, Unreachable), action.reason
    assert tour.clock.time() - begun < 20.0
    assert not tour.bumps


@pytest.mark.slow  # a long story
@pytest.mark.world("office", body="cyberdog2")
async def test_a_search_through_unknown_floor_is_bounded(tour: Tour) -> None:
    await tour.clock.advance(2.0)
    begun, stages, far, last = tour.clock.time(), set(), 0.0, tour.truth
    action = tour.head_for((12.0, -3.0))  # outside: no door leads there
    while not action.status.ended:
        await tour.clock.advance(0.1)
        far, last = far + last.distance_to(tour.truth), tour.truth
        stages.add(of_kind(action.feedback, NavigationFeedback).stage)
    assert isinstance(action.error, Unreachable), action.reason
    assert "unknown floor" in action.reason or "no path" in action.reason
    assert far < 60.0
    assert tour.clock.time() - begun < 90.0
    assert "driving" in stages


@pytest.mark.slow
@pytest.mark.world("office", body="hermes")
async def test_waits_for_a_known_way_that_closes_briefly(tour: Tour) -> None:
    """Rather than looking for a way through rooms that it never saw: robots in a corridor close it all the time."""
    action = tour.head_for((18.0, 10.0))
    await tour.until(lambda: tour.truth.x < 21.5)
    crowd = tour.world.stage.add_obstacle(Pose(19.6, 10.0), (0.3, 2.98, 1.0))
    for _ in range(90):
        await tour.clock.advance(0.1)
        assert 8.5 < tour.truth.y < 11.5
        assert action.status is ActionStatus.EXECUTING, action.reason
    tour.world.stage.remove_obstacle(crowd)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
