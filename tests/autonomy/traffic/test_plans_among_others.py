"""Plans among others: bodies that left are not obstacles, others' ways make routes longer but not slower."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.autonomy.docking.shelf_legs import Load
from roboglot.autonomy.navigation.low_sight import NONE, LowView
from roboglot.autonomy.navigation.planner import MOVING_SECONDS, OBSTACLE_SECONDS, Planner
from roboglot.autonomy.navigation.planning_options import KeepClear, PlanningOptions
from roboglot.autonomy.navigation.route import Route
from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import RESOLUTION
from roboglot.autonomy.traffic.right_of_way import Way
from roboglot.autonomy.traffic.traffic import Traffic
from roboglot.model.components.mapping.annotations import Annotations
from roboglot.model.components.sensing.odometry import Odometry
from roboglot.model.geometry import Point, Pose
from roboglot.model.robot import Robot

BODY = LowView(np.array([(1.0, 0.1 * n, 0.3) for n in range(-2, 3)]), NONE)  # 1 m ahead, off the lidar's plane
RADIUS = 0.25


@pytest.fixture
def belief(robot: Robot) -> Belief:
    """A map of 12 by 12 m of free floor."""
    belief = Belief(robot[Odometry])
    belief.map.make_room(-6.0, -6.0, 6.0, 6.0)
    belief.map.evidence[:] = -500
    return belief


@pytest.fixture
def planner(belief: Belief) -> Planner:
    return Planner(belief, RADIUS, Load())


def plan(planner: Planner, keep_clear: KeepClear = ()) -> Route:
    options = PlanningOptions(
        now=20.0, top=1.0, acceleration=1.0, tolerance=0.05, drawn=Annotations(), keep_clear=keep_clear
    )
    return planner.task(Point(), [Point(4.0, 0.0)], options).solve()


@pytest.mark.world("empty")
def test_camera_forgets_a_body_that_drives_on(planner: Planner) -> None:
    planner.observe_low(BODY, NONE, Pose(), 20.0)
    assert len(planner.low_around(Pose(), 3.0, 20.0 + OBSTACLE_SECONDS - 1.0))
    planner.forget_soon([Point(1.2, 0.0)], 20.0)
    assert len(planner.low_around(Pose(), 3.0, 20.0))
    assert not len(planner.low_around(Pose(), 3.0, 20.1 + MOVING_SECONDS))


@pytest.mark.world("empty")
def test_camera_forgets_a_body_far_away(planner: Planner) -> None:
    planner.observe_low(BODY, NONE, Pose(), 20.0)
    planner.forget([Point(1.2, 0.0)])
    assert not len(planner.low_around(Pose(), 3.0, 20.0))


@pytest.mark.world("empty")
def test_others_ways_do_not_slow_a_route(planner: Planner) -> None:
    crossing = np.array([(2.0, 0.1 * y) for y in range(-5, 6)])
    around, across = plan(planner, [(crossing, 0.3)]), plan(planner, [(crossing * (1.0, 8.0), 0.3)])
    assert around.length > 4.2  # around a short way …
    assert across.length < 4.2  # … and across a long one
    middle = int(np.abs(across.points[:, 0] - 2.0).argmin())
    assert across.speeds[middle] > 0.7


def among(robot: Robot, belief: Belief, *ways: Way) -> Traffic:
    traffic = Traffic(robot, belief)
    traffic._ways = list(ways)  # as the last scan and the radio had it
    return traffic


def coming(name: str = "", *, x: float = 3.0, outranks: bool = False) -> Way:
    points = np.stack([np.arange(x, x - 3.0, -0.2), np.zeros(15)], axis=1)
    return Way(points, 0.5, RADIUS, outranks, name, under_way=True)


@pytest.mark.world("empty")
@pytest.mark.parametrize(("way", "meets"), [(coming("b", outranks=True), True), (coming(), True), (coming("b"), False)])
def test_first_one_keeps_its_way(robot: Robot, belief: Belief, way: Way, *, meets: bool) -> None:
    traffic, path = among(robot, belief, way), np.stack([np.arange(0.0, 3.0, 0.05), np.zeros(60)], axis=1)
    traffic.free_distance(path, path, Pose(), 0.5, RADIUS)
    assert traffic.meets_others == meets
    traffic.close()


def straight(start: tuple[float, float], by: tuple[float, float], speed: float) -> Way:
    """Return the way of a robot that goes on by steps of ``by`` m."""
    return Way(np.array(start) + np.arange(15)[:, None] * np.array(by), speed, RADIUS, outranks=False, under_way=True)


@pytest.mark.world("empty")
@pytest.mark.parametrize(
    ("way", "seconds"),
    [
        (straight((1.5, -1.0), (0.0, 0.2), 0.5), (1.0 + 2 * RADIUS + 0.1) / 0.5),  # crosses
        (straight((1.5, 1.0), (0.0, 0.2), 0.5), 0.0),  # crossed
        (straight((1.0, 0.0), (0.2, 0.0), 0.5), 0.0),  # drives ahead
        (straight((3.0, 0.0), (-0.2, 0.0), 0.5), np.inf),  # comes
        (straight((1.5, 0.0), (0.0, 0.2), 0.0), np.inf),  # stands
    ],
)
def test_time_until_others_leave_the_way(robot: Robot, belief: Belief, way: Way, seconds: float) -> None:
    traffic, path = among(robot, belief, way), np.stack([np.arange(0.0, 3.0, 0.05), np.zeros(60)], axis=1)
    assert traffic.seconds_until_clear(path) == pytest.approx(seconds, abs=0.6)
    traffic.close()


@pytest.mark.world("empty")
@pytest.mark.parametrize("here", [1.0, 2.0, 3.0])
def test_one_of_two_in_a_corridor_backs_out(robot: Robot, belief: Belief, here: float) -> None:
    """The corridor leads from 0 to 5 m; the other one stands 0.8 m farther, and announces nothing."""
    corner, evidence = belief.map.corner, belief.map.evidence
    columns = slice(int((0.0 - corner.x) / RESOLUTION), int((5.0 - corner.x) / RESOLUTION))
    for y in (-0.5, 0.5):
        evidence[int((y - corner.y) / RESOLUTION), columns] = 500
    traffic, other = among(robot, belief, coming(x=here + 0.8)), among(robot, belief, coming(x=here))
    assert traffic.should_back_out(Pose(here)) == (here < 2.1)
    assert other.should_back_out(Pose(here + 0.8)) == (here > 2.1)
    traffic.close()
    other.close()


@pytest.mark.world("empty")
def test_flickering_echo_has_no_right_of_way(belief: Belief, robot: Robot) -> None:
    """A robot that comes out of it goes first; a ghost of a wall, seen for a moment, does not."""
    corner, evidence = belief.map.corner, belief.map.evidence
    rows = [int((y - corner.y) / RESOLUTION) for y in (-0.55, 0.55)]
    evidence[rows, int((1.0 - corner.x) / RESOLUTION) : int((5.0 - corner.x) / RESOLUTION)] = 500
    traffic, here, waits = Traffic(robot, belief), Pose(0.5), list[bool]()
    front = np.stack((0.02 * np.abs(np.arange(-4, 5)), 0.05 * np.arange(-4, 5)), axis=1)
    for scan in range(9):
        echoes = front + np.array((4.0 - 0.1 * scan, 0.0))
        traffic.observe(echoes, here, 20.0 + 0.1 * scan)
        waits.append(traffic.is_in_the_way(here))
    traffic.close()
    assert waits[:4] == [False] * 4
    assert waits[5:] == [True] * 4


@pytest.mark.world("empty")
@pytest.mark.parametrize("start", [3.2, 2.6])
def test_body_that_came_stays_off_the_map(belief: Belief, robot: Robot, start: float) -> None:
    """It may leave out of sight: as part of the map it would close its place for good. Furniture only seems to move."""
    traffic, kept = Traffic(robot, belief), list[bool]()
    front = np.stack((0.02 * np.abs(np.arange(-4, 5)), 0.05 * np.arange(-4, 5)), axis=1)
    for scan in range(800):
        echoes = front + np.array((max(2.0, start - 0.05 * scan), 0.0))
        traffic.observe(echoes, Pose(), 20.0 + 0.1 * scan)
        kept.append(any(abs(x - 2.16) < 0.1 and radius > 0.3 for x, _, radius in belief.others))
    assert set(kept[40:600]) == {start > 3.0}
    assert not any(kept[-100:])
    traffic.rest()
    traffic.observe(front + np.array((2.0, 0.0)), Pose(), 200.0)
    assert belief.others == []
    traffic.close()
