"""Obstacles and floor in a grid of depths, against the same rule written for whole arrays."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.kernels.depth import FLOOR, LOW, NEAR, STEEP, remember_low, seen_since, segment_ground, segment_ground_all

HEIGHT, INNER = 0.6, 0.2


@given(st.integers(0, 2**32 - 1), st.integers(2, 12), st.integers(2, 12), st.booleans())
def test_each_place_is_sorted_by_its_lower_neighbour(seed: int, rows: int, columns: int, looks_down: bool) -> None:
    random = np.random.default_rng(seed)
    rays, ways = random.uniform(-1, 1, (rows, columns, 3)), random.uniform(0.1, 3.0, (rows, columns))
    eye = random.uniform(0.0, 0.4, 3)
    if looks_down:  # on the floor, with a few objects
        rays[..., 2] = np.linspace(0.3, -0.8, rows)[:, None]
        ways = eye[2] / np.maximum(-rays[..., 2], 0.1) * random.uniform(0.9, 1.02, ways.shape)
    ways[random.random(ways.shape) < 0.1] = np.inf
    ways[random.random(ways.shape) < 0.05] = -np.inf
    places = rays * np.where(np.isfinite(ways), ways, np.nan)[..., None] + eye
    away, up = np.hypot(places[..., 0], places[..., 1]), places[..., 2]
    rise, farther = up[:-1] - up[1:], away[:-1] - away[1:]
    stands = (rise > STEEP * np.maximum(farther, 0.0)) & (up[:-1] > LOW) & (up[:-1] < HEIGHT) & (away[:-1] < NEAR)
    obstacles, floor = segment_ground(rays, ways, eye, HEIGHT, INNER)
    assert obstacles == pytest.approx(places[:-1][stands & (away[:-1] > INNER)])
    lies = (np.abs(up) < FLOOR) & (away < NEAR)
    assert floor[:, :2] == pytest.approx(places[lies][:, :2])
    steepness = np.broadcast_to(rays[0, :, 2] / np.hypot(rays[0, :, 0], rays[0, :, 1]), lies.shape)[lies]
    assert floor[:, 2] == pytest.approx(eye[2] + steepness * np.hypot(*(floor[:, :2] - eye[:2]).T))


@given(st.integers(0, 2**32 - 1), st.floats(-3.0, 3.0))
def test_only_what_nothing_explains_is_remembered(seed: int, yaw: float) -> None:
    random = np.random.default_rng(seed)
    evidence = np.where(random.random((40, 50)) < 0.02, 100, -100).astype(np.int16)
    seen, corner, pose = np.full((40, 50), 1.0, np.float32), np.array((-1.0, -0.7)), np.array((0.2, 0.1, yaw))
    floor, obstacles = random.uniform(-1.5, 1.5, (30, 3)), random.uniform(-1.5, 1.5, (40, 3))
    heights = random.uniform(-1.5, 1.5, (40, 50)).astype(np.float32)
    echoes, turn = (
        random.uniform(-1.0, 1.0, (6, 2)),
        np.array(((np.cos(yaw), np.sin(yaw)), (-np.sin(yaw), np.cos(yaw)))),
    )
    expected, new = seen.copy(), []
    for (x, y), top in zip(floor[:, :2] @ turn + pose[:2], floor[:, 2], strict=True):
        column, row = np.floor((x - corner[0]) / 0.05).astype(int), np.floor((y - corner[1]) / 0.05).astype(int)
        if 0 <= row < 40 and 0 <= column < 50 and heights[row, column] <= top:
            expected[row, column] = 0.0
    for x, y in obstacles[:, :2] @ turn + pose[:2]:
        column, row = np.floor((x - corner[0]) / 0.05).astype(int), np.floor((y - corner[1]) / 0.05).astype(int)
        inside = 1 <= row < 39 and 1 <= column < 49
        alone = inside and not (evidence[row - 1 : row + 2, column - 1 : column + 2] > 0).any()
        if alone and np.hypot(*(echoes - (x, y)).T).min() > 0.1:
            expected[row, column] = 7.0
            new.append((x, y))
    noted, many = np.empty((2000, 2), np.int32), seen.size
    noted[:many] = np.argwhere(seen)
    listed, found = remember_low(
        evidence, seen, heights, floor, obstacles, echoes, pose, corner, 7.0, 0.1, 0.05, noted, many
    )
    assert found == pytest.approx(np.array(new).reshape(-1, 2))
    assert (seen == expected).all()
    assert sorted(noted[:listed].tolist()) == np.argwhere(expected).tolist()


@pytest.mark.parametrize(("hangs", "remains"), [(0.7, True), (0.5, False)])
def test_floor_below_a_table_leaves_its_top(hangs: float, *, remains: bool) -> None:
    evidence, seen, heights = np.full((40, 40), -100, np.int16), *np.zeros((2, 40, 40), np.float32)
    floor, top = np.array([(1.0, 1.0, 0.6)]), np.array([(1.0, 1.0, 0.9), (1.0, 1.0, hangs)])
    none, nothing, pose, first = np.empty((0, 3)), np.empty((0, 2)), np.zeros(3), np.zeros(2)
    noted = np.empty((9, 2), np.int32)
    count, _ = remember_low(evidence, seen, heights, none, top, nothing, pose, first, 7.0, 0.1, 0.05, noted, 0)
    assert heights.max() == np.float32(hangs)  # its lowest point
    count, _ = remember_low(evidence, seen, heights, floor, none, nothing, pose, first, 8.0, 0.1, 0.05, noted, count)
    assert bool(seen.any()) == bool(count) == remains


def test_sensors_are_sorted_one_after_the_other() -> None:
    random = np.random.default_rng(5)
    rays, ways = random.uniform(-1, 1, (3, 8, 8, 3)), random.uniform(0.1, 3.0, (3, 8, 8))
    eyes = random.uniform(0.0, 0.4, (3, 3))
    each = [segment_ground(*of, HEIGHT, INNER) for of in zip(rays, ways, eyes, strict=True)]
    for part, found in enumerate(segment_ground_all(rays, ways, eyes, HEIGHT, INNER)):
        assert len(found)
        assert (found == np.concatenate([one[part] for one in each])).all()


def test_recent_cells_are_found_by_list_or_window() -> None:
    random, window = np.random.default_rng(6), np.array((5, 25, 10, 40))
    seen = np.where(random.random((30, 40)) < 0.1, random.uniform(0.0, 9.0, (30, 40)), 0.0).astype(np.float32)
    row, column = np.nonzero(seen[5:25, 10:40] >= 4.0)
    expected = np.stack((-1.0 + (column + 10 + 0.5) * 0.05, 2.0 + (row + 5 + 0.5) * 0.05), axis=1)
    noted = np.ascontiguousarray(np.argwhere(seen), np.int32)
    assert len(row)
    for listed in (len(noted), -1):
        assert (seen_since(seen, noted, listed, window, 4.0, -1.0, 2.0, 0.05) == expected).all()
        assert seen_since(seen, noted, listed, window, 9.5, -1.0, 2.0, 0.05).shape == (0, 2)


def test_a_list_that_overflows_is_given_up() -> None:
    evidence, seen = np.zeros((40, 40), np.int16), np.zeros((40, 40), np.float32)
    obstacles, none = np.stack((np.linspace(0.1, 1.8, 30), *np.full((2, 30), 1.0)), axis=1), np.empty((0, 3))
    heights = np.zeros_like(seen)
    where = np.zeros(3), np.zeros(2), 7.0, 0.1, 0.05
    for room in (5, 50):
        listed, _ = remember_low(
            evidence, seen, heights, none, obstacles, np.empty((0, 2)), *where, np.empty((room, 2), np.int32), 0
        )
        assert listed == (np.count_nonzero(seen) if room == 50 else -1)
        seen[:] = 0.0
