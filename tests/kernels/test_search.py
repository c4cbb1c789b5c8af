"""A* and the straightening of paths on small grids, against plain Dijkstra."""

from __future__ import annotations

import heapq
import itertools
import math

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.kernels.search import corners, line_cost, shortest_path, ways_from

costs = st.sampled_from([1.0, 1.0, 1.0, 2.0, 7.5, math.inf])


@st.composite
def grids(draw: st.DrawFn) -> np.ndarray:
    height, width = draw(st.integers(1, 10)), draw(st.integers(1, 10))
    cells = draw(st.lists(costs, min_size=height * width, max_size=height * width))
    return np.array(cells, np.float32).reshape(height, width)


def neighbours(cost: np.ndarray, cell: tuple[int, int]) -> list[tuple[tuple[int, int], float]]:
    row, col = cell
    found = []
    for dr, dc in ((-1, 0), (1, 0), (0, -1), (0, 1), (-1, -1), (-1, 1), (1, -1), (1, 1)):
        r, c = row + dr, col + dc
        if not (0 <= r < cost.shape[0] and 0 <= c < cost.shape[1]):
            continue
        if math.isinf(cost[row, c]) or math.isinf(cost[r, col]) or math.isinf(cost[r, c]):
            continue
        found.append(((r, c), math.hypot(dr, dc) * 0.5 * float(cost[row, col] + cost[r, c])))
    return found


def dijkstra(cost: np.ndarray, start: tuple[int, int], goal: tuple[int, int]) -> float:
    if math.isinf(cost[start]) or math.isinf(cost[goal]):
        return math.inf
    best, queue = {start: 0.0}, [(0.0, start)]
    while queue:
        value, cell = heapq.heappop(queue)
        if cell == goal:
            return value
        for other, step in neighbours(cost, cell):
            if value + step < best.get(other, math.inf):
                best[other] = value + step
                heapq.heappush(queue, (value + step, other))
    return math.inf


@settings(max_examples=100, deadline=None)
@given(grids(), st.data())
def test_all_ways_from_cell_cost_what_dijkstras_cost(cost: np.ndarray, data: st.DataObject) -> None:
    start = data.draw(st.tuples(st.integers(0, cost.shape[0] - 1), st.integers(0, cost.shape[1] - 1)))
    expected = [[dijkstra(cost, start, (row, col)) for col in range(cost.shape[1])] for row in range(cost.shape[0])]
    np.testing.assert_allclose(ways_from(cost, *start), expected, rtol=1e-4, atol=1e-4)


@settings(max_examples=200, deadline=None)
@given(grids(), st.data())
def test_the_path_costs_what_dijkstras_costs(cost: np.ndarray, data: st.DataObject) -> None:
    cell = st.tuples(st.integers(0, cost.shape[0] - 1), st.integers(0, cost.shape[1] - 1))
    start, goal = data.draw(cell), data.draw(cell)
    path = [(int(r), int(c)) for r, c in shortest_path(cost, *start, *goal)]
    expected = dijkstra(cost, start, goal)
    if math.isinf(expected):
        assert path == []
        return
    assert path[0] == start
    assert path[-1] == goal
    total = 0.0
    for a, b in itertools.pairwise(path):
        total += dict(neighbours(cost, a))[b]
    assert math.isclose(total, expected, rel_tol=1e-6, abs_tol=1e-6)
    assert path == [(int(r), int(c)) for r, c in shortest_path(cost, *start, *goal)]


@settings(max_examples=100, deadline=None)
@given(grids(), st.data())
def test_straightened_paths_stay_open_and_cost_no_more(cost: np.ndarray, data: st.DataObject) -> None:
    cell = st.tuples(st.integers(0, cost.shape[0] - 1), st.integers(0, cost.shape[1] - 1))
    path = shortest_path(cost, *data.draw(cell), *data.draw(cell))
    kept = list(corners(cost, path, 1.0))
    if not len(path):
        assert kept == []
        return
    assert (kept[0], kept[-1]) == (0, len(path) - 1)
    legs = list(itertools.pairwise(path))
    before = sum(line_cost(cost, *map(float, (*a, *b))) for a, b in legs)
    after = sum(line_cost(cost, *map(float, (*path[a], *path[b]))) for a, b in itertools.pairwise(kept))
    assert after <= before + 1e-6


def test_open_floor_is_crossed_in_one_line() -> None:
    cost = np.ones((40, 60), np.float32)
    path = shortest_path(cost, 2, 3, 35, 50)
    assert list(corners(cost, path, 1.0)) == [0, len(path) - 1]
