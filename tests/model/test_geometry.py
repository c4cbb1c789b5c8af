"""Frames and angles."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.model.components.mapping.localization import Region
from roboglot.model.components.motion.base import WheelSpeeds
from roboglot.model.geometry import ORIGIN, Point, Pose, Twist, wrap_angle
from roboglot.model.maps import OccupancyGrid

numbers = st.floats(-100, 100)
poses = st.builds(Pose, numbers, numbers, st.floats(-math.pi, math.pi))


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (Point(1.5, -20_000.0), "(1.5, -20000)"),
        (Pose(1e300, math.nan, 0.25), "(1e+300, nan, 0.25)"),
        (Twist(0.1, 0.0, math.inf), "(0.1, 0, inf)"),
        (WheelSpeeds(1.0, 2.0, 3.0, 4.0), "(1, 2, 3, 4)"),
        (Region(0.0, 0.0, -1.0, 2.0), "(0, 0) to (-1, 2)"),
    ],
)
def test_sentences_show_plain_numbers(value: object, words: str) -> None:
    assert f"not a place: {value}" == f"not a place: {words}"


@given(st.floats(-1e6, 1e6))
def test_wrapped_angles_point_the_same_way(angle: float) -> None:
    wrapped = wrap_angle(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.cos(wrapped) == pytest.approx(math.cos(angle), abs=1e-6)
    assert math.sin(wrapped) == pytest.approx(math.sin(angle), abs=1e-6)


def close(a: Pose, b: Pose) -> bool:
    return a.distance_to(b) < 1e-9 and abs(wrap_angle(a.yaw - b.yaw)) < 1e-9


@given(poses, poses)
def test_relative_undoes_compose(a: Pose, b: Pose) -> None:
    assert close(a.compose(b).relative_to(a), b)
    assert close(a.compose(a.inverse()), ORIGIN)


def test_compose_turns_with_the_frame() -> None:
    assert close(Pose(1, 2, math.pi / 2).compose(Pose(1, 0, 0)), Pose(1, 3, math.pi / 2))


@given(numbers, numbers, numbers, st.floats(0.1, 3), st.floats(0.1, 3))
def test_clamping_keeps_directions(x: float, y: float, yaw: float, top: float, turn: float) -> None:
    clamped = Twist(x, y, yaw).clamped(Twist(top, top, turn))
    assert clamped.speed <= top + 1e-9
    assert abs(clamped.yaw) <= turn
    assert clamped.x * y == pytest.approx(clamped.y * x, abs=1e-6)


def grid() -> OccupancyGrid:
    cells = np.zeros((40, 60), dtype=np.int8)
    cells[10:20, 30:50] = -5
    cells[19, 49] = 9
    return OccupancyGrid(cells, 0.1, Point(-3, -2))


def test_trimming_keeps_cells_in_place() -> None:
    small = grid().trimmed()
    assert (small.width, small.height) == (20, 10)
    assert small.origin == Point(0, -1)
    assert small.log_odds[9, 19] == 9
    empty = OccupancyGrid(np.zeros((5, 5), dtype=np.int8), 0.1, Point()).trimmed()
    assert (empty.width, empty.height) == (0, 0)


@given(numbers, numbers, numbers, numbers)
def test_a_window_is_a_part_of_the_map(x0: float, y0: float, x1: float, y1: float) -> None:
    whole = grid()
    part = whole.window(x0, y0, x1, y1)
    row, column = whole.cell_of(Point(part.origin.x + 0.05, part.origin.y + 0.05))
    assert np.array_equal(part.log_odds, whole.log_odds[row : row + part.height, column : column + part.width])
