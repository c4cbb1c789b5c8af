"""Visiting orders against trying them all."""

from __future__ import annotations

import itertools
import time

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.kernels.touring import visiting_order


def costs_between(places: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(np.hypot(*(places[:, None] - places[None]).transpose(2, 0, 1)))


def length(costs: np.ndarray, order: tuple[int, ...] | np.ndarray) -> float:
    return sum(float(costs[a, b]) for a, b in itertools.pairwise(order))


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_a_few_places_are_ordered_exactly(count: int, seed: int) -> None:
    costs = costs_between(np.random.default_rng(seed).uniform(0, 30, (count, 2)))
    order = visiting_order(costs, 50, False)
    assert sorted(order) == list(range(count))
    assert order[0] == 0
    best = min(length(costs, (0, *rest)) for rest in itertools.permutations(range(1, count)))
    assert abs(length(costs, order) - best) < 1e-9


@settings(max_examples=60, deadline=None)
@given(st.integers(1, 7), st.integers(0, 2**32 - 1))
def test_short_round_trips_are_optimal_including_the_return(count: int, seed: int) -> None:
    costs = costs_between(np.random.default_rng(seed).uniform(0, 30, (count, 2)))
    order = visiting_order(costs, 50, True)
    assert sorted(order) == list(range(count))
    best = min(length(costs, (0, *rest, 0)) for rest in itertools.permutations(range(1, count)))
    assert abs(length(costs, (*order, 0)) - best) < 1e-9


def test_long_round_trips_are_nearly_the_shortest() -> None:
    """Places on a circle have one shortest round trip."""
    angles = np.random.default_rng(4).permutation(np.linspace(0, 2 * np.pi, 200, endpoint=False))
    costs = costs_between(np.column_stack((np.cos(angles), np.sin(angles))))
    order = visiting_order(costs, 50, True)
    assert sorted(order) == list(range(200))
    assert length(costs, (*order, 0)) < 1.02 * 2 * np.pi


@settings(max_examples=30, deadline=None)
@given(st.integers(14, 60), st.integers(0, 2**32 - 1))
def test_tour_visits_each_place_and_beats_nearest_first(count: int, seed: int) -> None:
    costs = costs_between(np.random.default_rng(seed).uniform(0, 30, (count, 2)))
    order, plain = visiting_order(costs, 50, False), visiting_order(costs, 0, False)
    assert sorted(order) == list(range(count))
    assert order[0] == 0
    assert length(costs, order) <= length(costs, plain) + 1e-9


def test_hundreds_of_places_take_less_than_a_second() -> None:
    costs = costs_between(np.random.default_rng(1).uniform(0, 100, (400, 2)))
    began = time.thread_time()
    order = visiting_order(costs, 50, False)
    assert time.thread_time() - began < 1.0
    assert length(costs, order) < 0.9 * length(costs, visiting_order(costs, 0, False))
