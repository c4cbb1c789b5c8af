"""Claim: on 2000x2000 cells a path is planned no slower than by pyastar2d, at equal or better cost.

pyastar2d is not a dependency: ``pip install pyastar2d`` to see the ratio, otherwise only our figures are printed. Both
get the same grid; cost is the length of the steps times what their cells cost. pyastar2d itself counts a diagonal step
like a straight one.
"""

from __future__ import annotations

import importlib
import statistics
import time
from collections.abc import Callable
from functools import partial

import numpy as np
from _claim import Claims
from numpy.typing import NDArray

from roboglot.kernels.search import inflated_cost, shortest_path

CELLS, ROOM, REPEATS = 2000, 120, 7
DOOR = 24  # cells
Path = NDArray[np.int32]


def office(seed: int) -> NDArray[np.float32]:
    """Rooms of 6 m with doors at random places and some furniture, inflated for a robot of 0.25 m."""
    draw = np.random.default_rng(seed)
    evidence = np.full((CELLS, CELLS), -100, np.int16)
    for at in range(0, CELLS, ROOM):
        evidence[at : at + 3, :] = evidence[:, at : at + 3] = 100
    for row in range(0, CELLS, ROOM):
        for column in range(0, CELLS, ROOM):
            gap, other = draw.integers(10, ROOM - DOOR - 10, 2)
            if draw.random() < 0.75 and row:
                evidence[row : row + 3, column + gap : column + gap + DOOR] = -100
            if draw.random() < 0.75 and column:
                evidence[row + other : row + other + DOOR, column : column + 3] = -100
            for _ in range(3):
                r, c = draw.integers(20, ROOM - 30, 2)
                evidence[row + r : row + r + 12, column + c : column + c + 16] = 100
    evidence[-3:] = evidence[:, -3:] = 100
    return inflated_cost(evidence, np.zeros((CELLS, CELLS), np.float32), 0.0, 0.05, 0.3, 0.75, 8.0, 3.0)


def cost_of(cost: NDArray[np.float32], path: Path) -> float:
    """Return the length of each step in cells times the mean cost of its cells."""
    steps = np.hypot(*np.diff(path, axis=0).T)
    along = cost[path[:, 0], path[:, 1]].astype(float)
    return float((steps * (along[1:] + along[:-1]) / 2).sum())


def timed(*plans: Callable[[], Path]) -> list[tuple[Path, float]]:
    """Results of each and its median processor seconds; run in turns on the same machine."""
    seconds: list[list[float]] = [[] for _ in plans]
    for _ in range(REPEATS):
        for plan, taken in zip(plans, seconds, strict=True):
            began = time.thread_time()
            plan()
            taken.append(time.thread_time() - began)
    return [(plan(), statistics.median(taken)) for plan, taken in zip(plans, seconds, strict=True)]


def main() -> None:
    try:
        rival = importlib.import_module("pyastar2d")
    except ImportError:
        rival = None
    cost, claims = office(1), Claims()
    floor = np.argwhere(np.isfinite(cost))
    for name, goal in (("far", (1950, 1950)), ("middle", (1000, 900)), ("near", (400, 350))):
        start, end = (tuple(floor[np.abs(floor - at).sum(axis=1).argmin()].tolist()) for at in ((50, 50), goal))
        plans = [partial(shortest_path, cost, *start, *end)]
        if rival:
            plans.append(partial(rival.astar_path, cost, start, end, allow_diagonal=True))
        (path, seconds), *others = timed(*plans)
        print(f"{name:7} {seconds * 1000:7.1f} ms of processor time  cost {cost_of(cost, path):9.2f}")
        for other, taken in others:
            claims.at_most(f"{name}, time in pyastar2d's", seconds / taken, 1.0, "x")
            claims.at_most(f"{name}, cost in pyastar2d's", cost_of(cost, path) / cost_of(cost, other), 1.0, "x")
    claims.finish()


if __name__ == "__main__":
    main()
