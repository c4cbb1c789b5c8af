"""What a grid of depths shows, against the same rule written for whole arrays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.kernels.depth import FLOOR, LOW, NEAR, STEEP, sort_out

HEIGHT = 0.6


@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.integers(2, 12), st.booleans())
def test_each_place_is_sorted_by_its_lower_neighbour(seed: int, rows: int, columns: int, looks_down: bool) -> None:
    random = np.random.default_rng(seed)
    rays, ways = random.uniform(-1, 1, (rows, columns, 3)), random.uniform(0.1, 3.0, (rows, columns))
    eye = random.uniform(0.0, 0.4, 3)
    if looks_down:  # on floor, with something here and there
        rays[..., 2] = np.linspace(0.3, -0.8, rows)[:, None]
        ways = eye[2] / np.maximum(-rays[..., 2], 0.1) * random.uniform(0.9, 1.02, ways.shape)
    ways[random.random(ways.shape) < 0.1] = np.inf
    ways[random.random(ways.shape) < 0.05] = -np.inf
    places = rays * np.where(np.isfinite(ways), ways, np.nan)[..., None] + eye
    away, up = np.hypot(places[..., 0], places[..., 1]), places[..., 2]
    rise, farther = up[:-1] - up[1:], away[:-1] - away[1:]
    stands = (rise > STEEP * np.maximum(farther, 0.0)) & (up[:-1] > LOW) & (up[:-1] < HEIGHT) & (away[:-1] < NEAR)
    obstacles, floor = sort_out(rays, ways, eye, HEIGHT)
    assert obstacles == pytest.approx(places[:-1][stands][:, :2])
    assert floor == pytest.approx(places[(np.abs(up) < FLOOR) & (away < NEAR)][:, :2])
