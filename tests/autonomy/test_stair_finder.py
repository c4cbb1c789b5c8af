"""Edges from made-up points, of which every one is known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from roboglot.autonomy.stairs.finder import find_drop, find_riser
from roboglot.model.geometry import Pose


def placed(points: np.ndarray, distance: float, turn: float) -> np.ndarray:
    """Points whose x leads over the edge and whose y runs along it, from its foot, as base_link sees them."""
    c, s = math.cos(turn), math.sin(turn)
    x, y = points[:, 0] + distance, points[:, 1]
    made = points.copy()
    made[:, 0], made[:, 1] = c * x - s * y, s * x + c * y
    return made


def riser(height: float, width: float = 0.6, noise: float = 0.005) -> np.ndarray:
    y, z = np.meshgrid(np.linspace(-width / 2, width / 2, 13), np.arange(0.03, height, 0.02))
    points = np.stack((np.zeros(y.size), y.ravel(), z.ravel()), axis=-1)
    points[:, 0] += np.random.default_rng(7).normal(0.0, noise, len(points))
    return points


def tread(height: float) -> np.ndarray:
    x, y = np.meshgrid(np.linspace(0.035, 0.11, 4), np.linspace(-0.25, 0.25, 9))
    return np.stack((x.ravel(), y.ravel(), np.full(x.size, height)), axis=-1)


@settings(max_examples=40, deadline=None)
@given(st.floats(0.45, 0.9), st.floats(-0.3, 0.3), st.floats(0.08, 0.2))
def test_a_riser_is_found_where_it_is(distance: float, turn: float, height: float) -> None:
    edge = find_riser(placed(np.concatenate((riser(height), tread(height))), distance, turn), np.empty((0, 2)))
    assert edge
    assert edge.distance == pytest.approx(distance, abs=0.012)
    assert edge.foot.yaw == pytest.approx(turn, abs=math.radians(1.5))
    assert edge.left + edge.right == pytest.approx(0.6, abs=0.06)


def test_something_as_high_as_lidar_is_a_wall() -> None:
    face = placed(riser(0.15), 0.6, 0.1)
    along = np.linspace(-0.5, 0.5, 21)
    wall = placed(np.stack((np.zeros(21), along), axis=-1), 0.6, 0.1)
    assert find_riser(face, wall) is None
    assert find_riser(face, placed(wall, 0.3, 0.0)) is not None  # the height of the next riser but one


def test_without_a_lidar_a_tread_must_be_seen() -> None:
    face = placed(riser(0.15), 0.6, 0.1)
    assert find_riser(face, None) is None
    assert find_riser(np.concatenate((face, placed(tread(0.15), 0.6, 0.1))), None) is not None


@pytest.mark.parametrize(
    "points",
    [
        riser(0.12, width=0.2),  # a box
        riser(0.3),  # higher than any step
        np.concatenate((riser(0.12), riser(0.12, width=0.2) - (0.15, 0.0, 0.0))),  # an object in front
        np.stack((0.2 * np.sin(np.linspace(0, 6, 40)), np.linspace(-0.3, 0.3, 40), np.full(40, 0.06)), axis=-1),
        riser(0.12)[:8],
        np.empty((0, 3)),
    ],
)
def test_points_without_a_step_give_no_edge(points: np.ndarray) -> None:
    assert find_riser(placed(points, 0.6, 0.0), np.empty((0, 2))) is None


@settings(max_examples=40, deadline=None)
@given(st.floats(0.45, 0.85), st.floats(-0.35, 0.35))
def test_a_drop_lies_between_floor_and_abyss(distance: float, turn: float) -> None:
    x, y = np.meshgrid(np.arange(-0.2, 0.2, 0.03), np.linspace(-0.25, 0.25, 11))
    x = x + np.random.default_rng(7).uniform(-0.015, 0.015, x.shape)
    ground = placed(np.stack((x.ravel(), y.ravel()), axis=-1), distance, turn)
    behind = x.ravel() > 0
    edge = find_drop(ground[~behind], ground[behind])
    assert edge
    assert edge.distance == pytest.approx(distance, abs=0.012)
    assert edge.foot.yaw == pytest.approx(turn, abs=math.radians(3))


def test_mixed_floor_and_abyss_are_no_edge() -> None:
    points = np.random.default_rng(7).uniform((0.4, -0.3), (0.9, 0.3), (200, 2))
    assert find_drop(points[::2], points[1::2]) is None
    assert find_drop(points, np.empty((0, 2))) is None
    assert find_drop(np.empty((0, 2)), points) is None


def test_reach_of_a_drop_is_found() -> None:
    x, y = np.meshgrid(np.arange(-0.2, 0.2, 0.02), np.linspace(-0.4, 0.4, 41))
    ground = np.stack((x.ravel() + 0.6, y.ravel()), axis=-1)
    lost = (ground[:, 0] > 0.6) | (ground[:, 1] < -0.3)
    edge = find_drop(ground[~lost], ground[lost])
    assert edge
    assert edge.right == pytest.approx(0.31, abs=0.03)
    assert edge.left > 0.4
    assert edge.foot.distance_to(Pose(0.6)) < 0.05


@settings(max_examples=60, deadline=None)
@given(
    hnp.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(3)), elements=st.floats(-2, 2)),
    hnp.arrays(np.float64, st.tuples(st.integers(0, 40), st.just(2)), elements=st.floats(-2, 2)),
)
def test_any_points_are_looked_at_without_an_error(points: np.ndarray, flat: np.ndarray) -> None:
    for edge in (find_riser(points, flat), find_riser(points, None), find_drop(points[:, :2], flat)):
        assert edge is None or (math.isfinite(edge.distance) and math.isfinite(edge.foot.yaw))
