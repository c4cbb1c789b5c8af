"""Narrow places are looked at piece by piece, which changes nothing about them."""

from __future__ import annotations

import numpy as np
import pytest

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.traffic.narrow_places import NarrowPlaces, narrow


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
    assert NarrowPlaces().at(grid, points, 0.0).tolist() == expected


def test_maps_count_as_a_moment_ago() -> None:
    grid, places = EvidenceGrid(), NarrowPlaces()
    grid.evidence = np.full((60, 200), -5, np.int16)
    here, there = np.array([(2.0, 1.5)]), np.array([(2.0, 1.5), (3.5, 1.5)])
    assert not places.at(grid, here, 0.0).any()
    grid.evidence[25, :] = grid.evidence[35, :] = 7
    assert not places.at(grid, there, 4.0).any()
    assert places.at(grid, there, 6.0).all()
