"""Branch and bound finds what trying every place finds."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.kernels.placing import PlaceSearch, pyramid, turned_offsets


@settings(max_examples=25, deadline=None)
@given(st.integers(0, 2**32 - 1), st.integers(1, 40), st.integers(1, 40))
def test_nothing_scores_higher_than_what_it_finds(seed: int, height: int, width: int) -> None:
    draw = np.random.default_rng(seed)
    field = (draw.random((height, width)) < 0.2).astype(np.uint8) * 200
    floor = (draw.random((height, width)) < 0.7).astype(np.uint8)
    offsets = turned_offsets(draw.uniform(-1.5, 1.5, (12, 2)), 6, 0.1)
    best = 0
    for turned in offsets:
        for row, col in np.argwhere(floor):
            r, c = turned[:, 0] + row, turned[:, 1] + col
            inside = (r >= 0) & (c >= 0) & (r < height) & (c < width)
            best = max(best, int(field[r[inside], c[inside]].astype(int).sum()))
    search = PlaceSearch(pyramid(field, 4), pyramid(floor, 4), offsets, (0, 0))
    score, heading, row, col = search.next(0)
    assert score == best
    assert search.next(0)[0] <= score
    if score:
        r, c = offsets[heading, :, 0] + row, offsets[heading, :, 1] + col
        inside = (r >= 0) & (c >= 0) & (r < height) & (c < width)
        assert floor[row, col]
        assert int(field[r[inside], c[inside]].astype(int).sum()) == score
