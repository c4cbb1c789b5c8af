"""Order of visits to places, from the first one: exact for a few, 2-opt and Or-opt beyond; open or closed tours."""

from __future__ import annotations

import numpy as np

from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.kernels.compiled import kernel

EXACT_MAX = 12  # places besides the start up to which the order is exact
RUN_MAX = 3  # consecutive places moved together
GAIN_MIN = 1e-9  # smaller gains do not count


@kernel("int64[::1](float64[:,::1], boolean)")
def _exact(costs: FloatArray, closed: bool) -> IntArray:
    """Held and Karp: the cheapest order of all places, beginning with place 0; at most EXACT_MAX + 1 places."""
    count = costs.shape[0] - 1
    best, came = np.empty((1 << count, count)), np.empty((1 << count, count), np.int64)
    for visited in range(1 << count):
        for last in range(count):
            best[visited, last], came[visited, last] = np.inf, -1
    for last in range(count):
        best[1 << last, last] = costs[0, last + 1]
    for visited in range(1, 1 << count):
        for last in range(count):
            so_far = best[visited, last]
            if so_far == np.inf:
                continue
            for other in range(count):
                if visited >> other & 1:
                    continue
                value = so_far + costs[last + 1, other + 1]
                grown = visited | 1 << other
                if value < best[grown, other]:
                    best[grown, other], came[grown, other] = value, last
    order, visited = np.empty(count + 1, np.int64), (1 << count) - 1
    last, least = 0, np.inf
    for candidate in range(count):
        value = best[visited, candidate] + (costs[candidate + 1, 0] if closed else 0.0)
        if value < least:
            last, least = candidate, value
    for at in range(count, 0, -1):
        order[at] = last + 1
        visited, last = visited ^ 1 << last, came[visited, last]
    order[0] = 0
    return order


@kernel("int64[::1](float64[:,::1])")
def _nearest_next(costs: FloatArray) -> IntArray:
    """Fill in an order that always goes on to the nearest place left."""
    count = costs.shape[0]
    order, left = np.empty(count, np.int64), np.empty(count, np.int64)
    for other in range(count):
        order[other], left[other] = 0, (1 if other > 0 else 0)
    for at in range(1, count):
        best = -1
        for other in range(count):
            if left[other] > 0 and (best < 0 or costs[order[at - 1], other] < costs[order[at - 1], best]):
                best = other
        order[at], left[best] = best, 0
    return order


@kernel("float64(float64[:,::1], int64, int64)")
def _step(costs: FloatArray, a: int, b: int) -> float:
    """Return the cost from a to b; b below 0: the tour ends with a."""
    return costs[a, b] if b >= 0 else 0.0


@kernel("void(int64[::1], int64, int64)")
def _turn_round(order: IntArray, first: int, last: int) -> None:
    """Put the places from ``first`` to ``last`` into the opposite order."""
    while first < last:
        order[first], order[last] = order[last], order[first]
        first, last = first + 1, last - 1


@kernel("void(int64[::1], int64, int64, int64)")
def _swap_runs(order: IntArray, first: int, second: int, end: int) -> None:
    """Put the places from ``second`` to before ``end`` in front of those from ``first`` on."""
    _turn_round(order, first, end - 1)
    _turn_round(order, first, first + end - second - 1)
    _turn_round(order, first + end - second, end - 1)


@kernel("boolean(float64[:,::1], int64[::1], boolean)")
def _improve(costs: FloatArray, order: IntArray, closed: bool) -> bool:
    """Do one pass of 2-opt and Or-opt over ``order``, in place; return True if it improved. Costs are symmetric."""
    count, better = order.shape[0], False
    end = 0 if closed else -1  # the successor of the last place
    for i in range(1, count - 1):
        for j in range(i + 1, count):
            after = order[j + 1] if j + 1 < count else end
            gain = costs[order[i - 1], order[i]] + _step(costs, order[j], after)
            gain -= costs[order[i - 1], order[j]] + _step(costs, order[i], after)
            if gain > GAIN_MIN:
                _turn_round(order, i, j)
                better = True
    for length in range(1, RUN_MAX + 1):
        for i in range(1, count - length + 1):
            first, last = order[i], order[i + length - 1]
            after = order[i + length] if i + length < count else end
            freed = costs[order[i - 1], first] + _step(costs, last, after) - _step(costs, order[i - 1], after)
            best, place = GAIN_MIN, -1
            for k in range(count):
                if i - 1 <= k < i + length:
                    continue
                following = order[k + 1] if k + 1 < count else end
                gain = (
                    freed + _step(costs, order[k], following) - costs[order[k], first] - _step(costs, last, following)
                )
                if gain > best:
                    best, place = gain, k
            if place >= 0:
                if place < i:
                    _swap_runs(order, place + 1, i, i + length)
                else:
                    _swap_runs(order, i, i + length, place + 1)
                better = True
    return better


@kernel("int64[::1](float64[:,::1], int64, boolean)")
def visiting_order(costs: FloatArray, passes: int, closed: bool) -> IntArray:
    """Return the places 0 to n-1 in the order of a short tour from place 0, and back to it if ``closed``.

    ``costs`` (n, n) symmetric, finite. Exact up to EXACT_MAX places besides the start; beyond, at most ``passes``
    improvements of the whole tour.
    """
    if costs.shape[0] <= 2:
        return _nearest_next(costs)
    if costs.shape[0] <= EXACT_MAX + 1:
        return _exact(costs, closed)
    order = _nearest_next(costs)
    for _ in range(passes):
        if not _improve(costs, order, closed):
            break
    return order
