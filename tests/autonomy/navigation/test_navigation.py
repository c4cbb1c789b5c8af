"""Navigation on the simulated robot: where it ends up is judged by the world, not by the robot."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.errors import Blocked, InvalidGoal, NotLocalized, Unreachable
from roboglot.model.events import ActionChanged, LocalizationLost, LocalizationRecovered
from roboglot.model.geometry import ORIGIN, Point, Pose, Twist, wrap_angle
from roboglot.model.maps import OccupancyGrid
from roboglot.testing import assert_pose
from tests.narrowing import of_kind

if TYPE_CHECKING:
    from tests.autonomy.conftest import Tour

CORRIDOR = str(Path(__file__).parents[1] / "worlds" / "corridor.toml")
WALL = (0.3, 2.3, 1.0)  # right across the corridor


async def visits_three_places(tour: Tour) -> None:
    for x, y, deg in ((22.5, 10.0, 180.0), (12.0, 7.2, -90.0), (11.0, 13.5, 45.0)):
        action = await tour.go((x, y), deg=deg)
        assert action.status is ActionStatus.SUCCEEDED, action.reason
        assert_pose(tour.truth, x=x, y=y, deg=deg, within=0.05, within_deg=2.0)
        assert tour.robot[Base].velocity.speed < 0.01
    assert not tour.bumps


@pytest.mark.world("office", seed=1)
async def test_goals_are_reached_within_5_cm_2_degrees(tour: Tour) -> None:
    await visits_three_places(tour)


@pytest.mark.slow  # further seeds of test_goals_are_reached_within_5_cm_2_degrees
@pytest.mark.world("office", seed=7)
async def test_goals_are_reached_with_other_luck_too(tour: Tour) -> None:
    await visits_three_places(tour)


@pytest.mark.slow  # in short: test_success_means_every_goal_was_reached
@pytest.mark.world("empty")
async def test_several_goals_in_turn_are_all_passed(tour: Tour) -> None:
    spots = [(3.0, 5.0), (5.0, 7.0), (7.0, 5.0), (5.0, 3.0)]
    action, nearest, reached = tour.head_for(*spots), [9.0] * 4, []
    while not action.status.ended:
        await tour.clock.advance(0.02)
        nearest = [min(old, tour.truth.distance_to(Point(*spot))) for old, spot in zip(nearest, spots, strict=True)]
        reached.append(4 - len(of_kind(action.feedback, NavigationFeedback).milestones))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert max(nearest) < 0.07
    assert nearest[-1] < 0.05
    assert reached == sorted(reached)
    assert reached[-1] == 3


@pytest.mark.world("empty")
async def test_feedback_counts_down(tour: Tour) -> None:
    reported: list[NavigationFeedback] = []

    def report(event: ActionChanged) -> None:
        if isinstance(event.action.feedback, NavigationFeedback):
            reported.append(event.action.feedback)

    tour.robot.events.listen(ActionChanged, report)
    action = await tour.go((6.0, 5.0), deg=90.0)
    stages = [feedback.stage for feedback in reported]
    assert stages[0] == "planning"
    assert [s for s in stages if s != "planning"] == sorted(s for s in stages if s != "planning")  # driving, turning
    lengths = [feedback.remaining.length for feedback in reported if feedback.stage == "driving"]
    assert lengths == sorted(lengths, reverse=True)
    assert lengths[0] == pytest.approx(tour.start.distance_to(Point(6.0, 5.0)), abs=0.3)
    assert action.status is ActionStatus.SUCCEEDED


@pytest.mark.world("empty")
async def test_brakes_before_new_obstacle_and_drives_around_it(tour: Tour) -> None:
    action = tour.head_for((8.5, 5.0))
    await tour.until(lambda: tour.truth.x > 3.0)
    tour.world.stage.add_obstacle(Pose(tour.truth.x + 1.2, tour.truth.y, 0.0), (0.5, 0.5, 1.0))
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(tour.truth, x=8.5, y=5.0)
    assert not tour.bumps
    assert tour.blocks
    assert tour.blocks[0].action is action


@pytest.mark.slow  # in short: test_it_gives_up_after_half_a_minute
@pytest.mark.world(CORRIDOR)
async def test_waits_where_there_is_no_way_around(tour: Tour) -> None:
    action = tour.head_for((8.5, 1.2))
    await tour.until(lambda: tour.truth.x > 3.0)
    wall = tour.world.stage.add_obstacle(Pose(5.0, 1.2, 0.0), WALL)
    await tour.clock.advance(10.0)
    assert action.status is ActionStatus.EXECUTING
    assert of_kind(action.feedback, NavigationFeedback).stage == "waiting"
    assert tour.truth.x < 4.7
    tour.world.stage.remove_obstacle(wall)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert not tour.bumps


@pytest.mark.world(CORRIDOR)
async def test_it_gives_up_after_half_a_minute(tour: Tour) -> None:
    action = tour.head_for((8.5, 1.2))
    await tour.until(lambda: tour.truth.x > 3.0)
    tour.world.stage.add_obstacle(Pose(5.0, 1.2, 0.0), WALL)
    begun = tour.clock.time()
    await tour.end_of(action)
    assert action.status is ActionStatus.ABORTED
    assert isinstance(action.error, Blocked)
    assert 29.0 < tour.clock.time() - begun < 36.0
    assert not tour.bumps


@pytest.mark.slow
@pytest.mark.world(CORRIDOR)
async def test_does_not_press_long_against_an_unseen_obstacle(tour: Tour) -> None:
    tour.world.stage.add_obstacle(Pose(5.0, 1.2, 0.0), (0.3, 2.3, 0.2))
    action = tour.head_for((8.5, 1.2))
    await tour.until(lambda: tour.robot[Base].velocity.speed > 1.0)
    await tour.until(lambda: of_kind(action.feedback, NavigationFeedback).stage == "waiting")
    assert not tour.bumps  # its depth camera saw it
    await tour.until(lambda: bool(tour.bumps))  # by then it is out of sight, and forgotten
    touched = tour.clock.time()
    await tour.end_of(action)
    assert isinstance(action.error, Blocked)
    assert tour.clock.time() - touched < 2.0


@pytest.mark.slow
@pytest.mark.world("empty", body="hermes")
async def test_robot_leaves_what_only_its_bumper_feels(tour: Tour) -> None:
    box, goal = tour.start.compose(Pose(1.5, -0.52)), tour.start.compose(Pose(4.0, 0.0))
    tour.world.stage.add_obstacle(box, (0.1, 0.6, 0.1))  # below its lidar, and to the right of its camera's view
    tour.robot[Driving].drive(Twist(x=0.2), lifetime=20.0)
    await tour.until(lambda: bool(tour.bumps))
    await tour.clock.advance(15.0)  # longer than obstacles out of sight are remembered
    action = await tour.go((goal.x, goal.y))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert tour.truth.distance_to(goal) < 0.1


@pytest.mark.world("empty")
async def test_cancel_stops_within_the_braking_distance(tour: Tour) -> None:
    action = tour.head_for((8.5, 5.0))
    await tour.until(lambda: tour.robot[Base].velocity.speed > 1.0)
    before = tour.truth
    action.cancel()
    await tour.clock.advance(1.0)
    assert action.status is ActionStatus.CANCELED
    assert tour.truth.distance_to(before) < 0.45
    after = tour.truth
    await tour.clock.advance(2.0)
    assert tour.truth.distance_to(after) < 0.002


@pytest.mark.slow
@pytest.mark.world("empty")
async def test_pause_holds_and_resume_goes_on(tour: Tour) -> None:
    action = tour.head_for((8.5, 5.0))
    await tour.until(lambda: tour.robot[Base].velocity.speed > 1.0)
    action.pause()
    await tour.clock.advance(1.0)
    held = tour.truth
    await tour.clock.advance(40.0)  # longer than the patience with obstacles
    assert tour.truth.distance_to(held) < 0.002
    action.resume()
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert_pose(tour.truth, x=8.5, y=5.0)


@pytest.mark.world("empty")
async def test_does_not_set_out_where_no_path_leads(tour: Tour) -> None:
    await tour.go((5.0, 5.0))
    here = tour.truth
    for spot in ((9.95, 5.0), (20.0, 5.0), (500.0, 5.0)):  # in the wall, behind it, off every grid
        action = await tour.go(spot)
        assert isinstance(action.error, Unreachable), spot
    assert tour.truth.distance_to(here) < 0.01
    with pytest.raises(Unreachable):
        await tour.robot[Navigation].plan(Point(0.0, 0.0), tour.on_map(9.95, 5.0))


@pytest.mark.world("empty")
async def test_plan_leads_from_start_to_goal_around_walls(tour: Tour) -> None:
    tour.world.stage.add_obstacle(Pose(5.0, 4.0, 0.0), (0.3, 8.0, 1.0))  # a gap in the north
    await tour.clock.advance(3.0)
    path = await tour.robot[Navigation].plan(tour.on_map(3.0, 3.0), tour.on_map(8.0, 3.0))
    assert path.points[0] == tour.on_map(3.0, 3.0)
    assert path.points[-1] == tour.on_map(8.0, 3.0)
    assert 10.0 < path.length < 14.0
    assert tour.truth.distance_to(tour.start) < 0.01


@pytest.mark.world("empty")
async def test_speed_ratio_slows(tour: Tour) -> None:
    fastest = 0.0
    action = tour.head_for((tour.truth.x + 1.5, tour.truth.y), speed_ratio=0.25)
    while not action.status.ended:
        await tour.clock.advance(0.1)
        fastest = max(fastest, tour.robot[Base].velocity.speed)
    assert 0.25 < fastest < 0.32


@pytest.mark.slow  # long; in short: test_second_try_continues_at_the_next_goal
@pytest.mark.world(CORRIDOR)
async def test_retries_try_again(tour: Tour) -> None:
    action = tour.head_for((8.5, 1.2), retries=8)
    await tour.until(lambda: tour.truth.x > 3.0)
    wall = tour.world.stage.add_obstacle(Pose(5.0, 1.2, 0.0), WALL)
    await tour.clock.advance(45.0)
    assert action.status is ActionStatus.EXECUTING
    tour.world.stage.remove_obstacle(wall)
    await tour.end_of(action)
    assert action.status is ActionStatus.SUCCEEDED, action.reason


@pytest.mark.slow
@pytest.mark.world("empty")
async def test_lost_robot_stops_and_goes_on_when_found(tour: Tour) -> None:
    await tour.clock.advance(3.0)
    news: list[LocalizationLost | LocalizationRecovered] = []
    tour.robot.events.listen(LocalizationLost, news.append)
    tour.robot.events.listen(LocalizationRecovered, news.append)
    tour.robot[Localization].set_pose(tour.robot[Localization].pose.compose(Pose(4.0, 2.5, 0.8)))
    action = await tour.go((6.0, 5.0))
    assert action.status is ActionStatus.SUCCEEDED, action.reason
    assert isinstance(news[0], LocalizationLost)
    assert isinstance(news[-1], LocalizationRecovered)
    assert tour.error[0] < 0.05


@pytest.mark.slow  # in short: test_move_of_a_carried_robot_does_not_succeed
@pytest.mark.world("office")
@pytest.mark.parametrize(
    ("x", "y", "deg"), [(13.0, 6.6, -60.0), pytest.param(12.0, 6.5, -60.0, marks=pytest.mark.slow)]
)
async def test_robot_carried_while_turning_at_goal_fails(tour: Tour, x: float, y: float, deg: float) -> None:
    await tour.go((12.0, 9.8))
    drive = tour.head_for((12.0, 6.5), deg=90)
    goal = Pose(12.0, 6.5, math.radians(90.0))
    await tour.until(lambda: tour.truth.distance_to(goal) < 0.05 and abs(tour.truth.yaw - goal.yaw) < 0.2)
    tour.world.stage.place("a", Pose(x, y, math.radians(deg)))
    await tour.end_of(drive)
    turned = abs(math.degrees(wrap_angle(tour.truth.yaw - goal.yaw)))
    assert drive.status is ActionStatus.ABORTED or (tour.truth.distance_to(goal) < 0.05 and turned < 2.0)


@pytest.mark.slow  # long; in short: test_it_gives_up_after_half_a_minute
@pytest.mark.world("empty")
async def test_navigation_gives_up_on_a_foreign_map(tour: Tour) -> None:
    await tour.clock.advance(3.0)
    walls = np.full((200, 240), -100, np.int8)
    walls[:, ::20] = walls[::50] = 100
    walls[60:90] = -100  # a passage of 1.5 m through something that this room's map lacks
    tour.robot[Mapping].load(OccupancyGrid(walls, 0.05, Point(-6.0, -3.75)), Pose(0.0, 0.0))
    action = await tour.go((3.0, 5.0))
    assert isinstance(action.error, NotLocalized), action.reason
    assert tour.robot[Localization].lost is not None
    assert tour.world.truth.pose_of("a").distance_to(tour.start) < 2.0  # it stopped soon after


@pytest.mark.world("empty")
async def test_drive_ends_with_its_map(tour: Tour) -> None:
    """On a map with another origin its goal is elsewhere; a map that grew in its frame changes nothing."""
    drive = tour.head_for((8.0, 5.0))
    await tour.clock.advance(3.0)
    mapping = tour.robot[Mapping]
    tour.robot[Docking].set_home(Pose(1.0, 0.5))
    mapping.load(mapping.grid, tour.robot[Localization].pose, origin=ORIGIN)
    await tour.clock.advance(0.5)
    assert tour.robot[Base].velocity.speed > 0.1
    assert tour.robot[Docking].home == Pose(1.0, 0.5)
    mapping.clear()
    await tour.end_of(drive)
    assert isinstance(drive.error, Unreachable), drive.reason
    assert tour.robot[Base].velocity.speed < 0.01


@pytest.mark.world("empty")
async def test_drive_that_waits_ends_with_its_map(tour: Tour) -> None:
    """It waits until the drive before it has braked; meanwhile a client clears the map."""
    tour.head_for((8.0, 5.0))
    await tour.clock.advance(3.0)
    drive = tour.head_for((2.0, 5.0))
    assert drive.status is ActionStatus.ACCEPTED
    tour.robot[Mapping].clear()
    await tour.end_of(drive)
    assert isinstance(drive.error, Unreachable), drive.reason
    tour.robot[Mapping].clear()  # after its end, it has no effect
    assert drive.status is ActionStatus.ABORTED


@pytest.mark.world("empty")
async def test_driving_by_hand_takes_over(tour: Tour) -> None:
    action = tour.head_for((8.5, 5.0))
    await tour.clock.advance(2.0)
    tour.robot[Driving].drive(Twist(x=0.2), lifetime=1.0)
    await tour.clock.advance(2.0)
    assert action.status is ActionStatus.CANCELED


@pytest.mark.world("empty")
async def test_nonsense_is_refused(tour: Tour) -> None:
    navigation = tour.robot[Navigation]
    for goals, options in (
        ([], NavigationOptions()),
        ([Point(math.nan, 0.0)], NavigationOptions()),
        ([Point(math.inf, 0.0)], NavigationOptions()),
        ([Point()] * 5000, NavigationOptions()),
        ([Point()], NavigationOptions(yaw=math.nan)),
        ([Point()], NavigationOptions(speed_ratio=0.0)),
        ([Point()], NavigationOptions(speed_ratio=math.nan)),
        ([Point()], NavigationOptions(tolerance=-1.0)),
        ([Point()], NavigationOptions(retries=-1)),
    ):
        with pytest.raises(InvalidGoal):
            navigation.navigate_to(goals, options)
    assert not tour.robot.actions.running()


@pytest.mark.world("empty")
async def test_places_are_ordered_by_ways_that_lead_there(tour: Tour) -> None:
    await tour.clock.advance(1.0)
    navigation = tour.robot[Navigation]
    spots = [(8.0, 5.0), (3.0, 5.0), (6.0, 5.0), (4.5, 5.0)]
    assert await navigation.visiting_order([tour.on_map(*spot) for spot in spots]) == [1, 3, 2, 0]
    row = [tour.on_map(1.0 + 0.4 * number, 5.0) for number in (*range(1, 20, 2), *range(2, 20, 2))]
    order = await navigation.visiting_order(row)
    assert [row[k].distance_to(Point()) for k in order] == sorted(p.distance_to(Point()) for p in row)
    assert await navigation.visiting_order([]) == []
    with pytest.raises(InvalidGoal):
        await navigation.visiting_order([Point()] * 501)
