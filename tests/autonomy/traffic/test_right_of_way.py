"""Right of way where two ways meet, by announcements and by sight, and where the other one stops."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.traffic.movers import MoverTracker
from roboglot.autonomy.traffic.right_of_way import (
    CLEAR_MOVING,
    DECELERATION,
    REACTION,
    Way,
    announced_way,
    free_of_movers,
    meetings,
    rank,
)
from roboglot.model.components.logistics.traffic_radio import Announcement
from roboglot.model.geometry import Point, Pose

RADIUS = 0.25
EAST = np.stack([np.arange(0.0, 6.0, 0.05), np.zeros(120)], axis=1)  # 6 m along x


def north(x: float, start: float = -2.0, speed: float = 0.5) -> Way:
    """Return the way of a robot that crosses EAST at ``x``."""
    points = np.stack([np.full(21, x), start + 0.2 * np.arange(21)], axis=1)
    return Way(points, speed, RADIUS, outranks=True)


announcements = st.builds(
    Announcement,
    robot=st.sampled_from("abcdef"),
    frame=st.just("map"),
    stamp=st.just(0.0),
    pose=st.builds(Pose, st.floats(-5, 5), st.floats(-5, 5)),
    speed=st.floats(0, 1),
    radius=st.just(RADIUS),
    priority=st.integers(-100, 100),
    way=st.just((Point(1.0, 0.0),)),
    inside=st.booleans(),
)


@given(announcements, announcements)
def test_of_two_robots_exactly_one_goes_first(one: Announcement, other: Announcement) -> None:
    if one.robot == other.robot:
        other = replace(other, robot=one.robot + "'")
    assert announced_way(one, other).outranks != announced_way(other, one).outranks


@given(st.lists(announcements, min_size=2, max_size=6, unique_by=lambda a: a.robot))
def test_ranks_make_an_order(many: list[Announcement]) -> None:
    first = min(many, key=rank)
    assert not any(announced_way(other, first).outranks for other in many if other is not first)


def test_inside_goes_before_priority_before_name() -> None:
    a = Announcement("a", "map", 0.0, Pose(), 0.5, RADIUS)
    b = replace(a, robot="b")
    assert rank(a) < rank(b)
    assert rank(replace(b, priority=1)) < rank(a)
    assert rank(replace(b, inside=True)) < rank(replace(a, priority=100))


def test_waits_before_a_crossing_way() -> None:
    found = list(meetings(EAST, 0.5, RADIUS, [north(2.0)]))
    assert len(found) == 1
    assert 2.0 - 2 * RADIUS - 0.35 <= found[0].along <= 2.0 - 2 * RADIUS
    assert not found[0].stands_in_it


@pytest.mark.parametrize("way", [north(2.0, start=-4.5, speed=0.4), north(9.0), north(2.0, start=1.0)])
def test_far_or_gone_ones_hold_up_no_one(way: Way) -> None:
    assert list(meetings(EAST, 0.5, RADIUS, [way])) == []


def test_brakes_for_what_cannot_stop_any_more() -> None:
    fast = north(2.0, start=-1.0, speed=1.0)
    free = free_of_movers(EAST, Pose(), RADIUS, [fast])
    assert 2.0 - 2 * RADIUS - 0.2 < free < 2.0
    assert free_of_movers(EAST, Pose(), RADIUS, [north(2.0, start=-1.0, speed=0.0)]) == math.inf


@pytest.mark.parametrize("speed", [0.2, 0.3])
def test_brakes_for_what_creeps_towards_it(speed: float) -> None:
    """Two that creep would close the gap that each keeps to what stands, before either sees it."""
    creeps = Way(np.stack([np.arange(1.0, 0.0, -0.2), np.zeros(5)], axis=1), speed, RADIUS, outranks=False)
    stops = 1.0 - speed * REACTION - speed**2 / (2.0 * DECELERATION)
    free = free_of_movers(EAST, Pose(), RADIUS, [creeps])
    assert free == pytest.approx(stops - 2 * RADIUS - CLEAR_MOVING, abs=0.06)


@given(st.floats(-math.pi, math.pi), st.floats(0.3, 1.2))
def test_velocity_of_a_mover_comes_from_its_echoes(heading: float, speed: float) -> None:
    tracker, grid, pose = MoverTracker(), EvidenceGrid(), Pose(0.0, -3.0)
    grid.make_room(-4.0, -4.0, 4.0, 4.0)
    vx, vy = speed * math.cos(heading), speed * math.sin(heading)
    turns = np.linspace(0.0, math.tau, 40, endpoint=False)
    rim = 0.2 * np.stack([np.cos(turns), np.sin(turns)], axis=1)
    for step in range(6):
        middle = np.array((vx, vy)) * step * 0.1
        front = rim[rim @ (np.array((pose.x, pose.y)) - middle) > 0.0] + middle  # the visible half
        seen = front[np.argsort(np.arctan2(front[:, 1] - pose.y, front[:, 0] - pose.x))]
        movers = tracker.observe(seen, grid, pose, step * 0.1)
    assert len(movers) == 1
    assert movers[0].vx == pytest.approx(vx, abs=0.15)
    assert movers[0].vy == pytest.approx(vy, abs=0.15)
