"""The distance transform, both ways of it, against the definition."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from roboglot.kernels.distance import NEAR_MAX, distances


@settings(max_examples=100, deadline=None)
@given(
    arrays(np.uint8, st.tuples(st.integers(1, 12), st.integers(1, 12)), elements=st.integers(0, 1)), st.floats(1, 30)
)
def test_distances_are_exact_up_to_the_cap(marked: np.ndarray, cap: float) -> None:
    rows, cols = np.indices(marked.shape)
    expected = np.full(marked.shape, cap)
    for row, col in np.argwhere(marked):
        expected = np.minimum(expected, np.hypot(rows - row, cols - col))
    np.testing.assert_allclose(distances(marked, cap), expected, rtol=1e-5)


@settings(max_examples=30, deadline=None)
@given(arrays(np.uint8, st.tuples(st.integers(1, 40), st.integers(1, 40)), elements=st.integers(0, 1), fill=st.just(0)))
def test_near_and_far_agree_to_the_bit(marked: np.ndarray) -> None:
    near, far = distances(marked, NEAR_MAX), distances(marked, NEAR_MAX + 1.0)
    assert (near[near < NEAR_MAX] == far[near < NEAR_MAX]).all()
    assert (far[near == NEAR_MAX] >= NEAR_MAX).all()
