"""Narrow places: corridors, and doors in thin walls; looked at piece by piece, which changes nothing about them."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.traffic.narrow_finder import NarrowFinder, narrow
from roboglot.kernels.distance import join


@pytest.mark.parametrize("shape", [(90, 300), (128, 70)])
def test_pieces_are_as_the_whole(shape: tuple[int, int]) -> None:
    random, grid = np.random.default_rng(7), EvidenceGrid()
    grid.evidence = np.full(shape, -5, np.int16)
    grid.evidence[random.random(shape) < 0.004] = 7
    grid.evidence[random.random(shape) < 0.01] = 0
    points = random.uniform(-0.02, 1.02, (400, 2)) * (shape[1] * RESOLUTION, shape[0] * RESOLUTION)
    whole, cells = narrow(grid.evidence), np.floor(points / RESOLUTION).astype(int)
    inside = [0 <= row < shape[0] and 0 <= column < shape[1] for column, row in cells]
    expected = [ok and bool(whole[row, column]) for ok, (column, row) in zip(inside, cells, strict=True)]
    assert 0 < sum(expected) < sum(inside)
    assert NarrowFinder().at(grid, points, 0.0).tolist() == expected


def test_maps_count_as_a_moment_ago() -> None:
    grid, places = EvidenceGrid(), NarrowFinder()
    grid.evidence = np.full((60, 200), -5, np.int16)
    here, there = np.array([(2.0, 1.5)]), np.array([(2.0, 1.5), (3.5, 1.5)])
    assert not places.at(grid, here, 0.0).any()
    grid.evidence[25, :] = grid.evidence[35, :] = 7
    assert not places.at(grid, there, 4.0).any()
    assert places.at(grid, there, 6.0).all()


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("width", "is_narrow"), [(0.9, True), (1.1, True), (2.0, False)])
def test_doors_in_thin_walls_are_narrow(width: float, *, is_narrow: bool, turned: bool) -> None:
    evidence = np.full((100, 120), -5, np.int16)
    evidence[[0, -1]] = evidence[:, [0, -1]] = 7  # a room of 6 by 5 m …
    evidence[:, 60:62] = 7  # … in two halves
    half = round(width / RESOLUTION / 2)
    evidence[50 - half : 50 + half, 60:62] = -5
    found = narrow(np.ascontiguousarray(evidence.T)).T if turned else narrow(evidence)
    assert found[50, 61] == found[50, 56] == found[50 + half - 6, 66] == is_narrow
    assert not found[50, 61 + round(0.8 / RESOLUTION)]
    assert not found[8, 8]  # a robot in a corner of the room


def test_a_door_at_a_slant_is_narrow() -> None:
    row, column = np.indices((120, 120))
    wall = np.abs(row - 0.6 * column - 30) < 2.0
    gap = np.hypot(row - 66, column - 60) < 0.5 / RESOLUTION
    found = narrow(np.where(wall & ~gap, 7, -5).astype(np.int16))
    assert found[66, 60]
    assert not found[90, 46]


def test_places_between_narrow_ones_count_as_narrow() -> None:
    way = np.array([0, 1, 0, 0, 1, 0, 0, 0, 0, 1, 0], bool)
    join(way, 3)
    assert way.astype(int).tolist() == [0, 1, 1, 1, 1, 0, 0, 0, 0, 1, 0]
    join(none := np.zeros(4, bool), 3)
    assert not none.any()
