"""A single thing among the lidar's points: found where it stands, no wall, found again where it went."""

from __future__ import annotations

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from roboglot.autonomy.following.thing_finder import WIDE_MAX, moved_thing, thing_at
from roboglot.model.geometry import Point

WALL = np.array([[3.0, y] for y in np.arange(-4.0, 4.0, 0.05)])
places = st.floats(-2.0, 2.0)


def round_thing(x: float, y: float, radius: float = 0.2) -> np.ndarray:
    return np.array(
        [[x + radius * math.cos(a), y + radius * math.sin(a)] for a in np.linspace(0, math.tau, 24, endpoint=False)]
    )


@given(places, places, st.floats(0.05, 0.3))
def test_isolated_things_are_found_at_their_middle(x: float, y: float, radius: float) -> None:
    points = np.concatenate([WALL, round_thing(x, y, radius)])
    found = thing_at(points, Point(x - radius, y))
    assert found
    assert found.distance_to(Point(x, y)) < 0.1


def test_wall_is_no_thing_and_neither_is_air() -> None:
    assert thing_at(WALL, Point(3.0, 0.0)) is None
    assert thing_at(WALL, Point(1.0, 0.0)) is None
    assert thing_at(np.empty((0, 2)), Point()) is None


def test_thing_is_followed_across_scans_along_a_wall() -> None:
    at = Point(1.0, 0.0)
    for step in range(20):
        x, y = 1.0 + 0.08 * step, 0.05 * step
        now = moved_thing(np.concatenate([WALL, round_thing(x, y)]), at)
        assert now
        at = now
        assert at.distance_to(Point(x, y)) < 0.1
    assert moved_thing(WALL, Point(0.0, 0.0)) is None  # it is gone


def test_thing_that_touches_a_wall_is_kept() -> None:
    points = np.concatenate([WALL, round_thing(2.75, 0.0)])
    now = moved_thing(points, Point(2.7, 0.0))
    assert now
    assert now.distance_to(Point(2.75, 0.0)) < WIDE_MAX / 2
    assert thing_at(points, Point(2.7, 0.0)) is None  # chosen there it belongs to the wall
