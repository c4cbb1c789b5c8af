"""Rectangles that cover exactly the set cells, once each."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from roboglot.simulation.building.rectangles import cover


@given(arrays(bool, array_shapes(min_dims=2, max_dims=2, max_side=12), elements=st.booleans()))
def test_covers_every_set_cell_once_and_nothing_else(cells):
    times = np.zeros(cells.shape, int)
    for row, column, rows, columns in cover(cells):
        times[row : row + rows, column : column + columns] += 1
    assert (times == cells).all()


def test_a_full_block_is_one_rectangle():
    assert cover(np.ones((7, 9), bool)) == [(0, 0, 7, 9)]


def test_columns_are_not_cut_into_rows():
    cells = np.zeros((20, 9), bool)
    cells[:, ::2] = True
    assert len(cover(cells)) == 5
