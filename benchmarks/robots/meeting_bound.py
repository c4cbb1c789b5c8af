"""A reference for `scripts/bench meeting`: time that one schedule for all robots would need, in the same scenarios.

It knows all robots, goals and speeds exactly. Discs move at 1 m/s on a grid, turn and brake at no cost, and keep 0.1 m
from each other and 0.05 m from walls. They are planned one after the other in space and time, around those before; the
best of several orders counts. That is not a proven lower bound, but shows roughly what perfect coordination could
reach. Real robots need more time: they see and hear only what is near, have to turn, and slow down beside others.

    scripts/bench meeting_bound [--first 0] [--scenarios 4] [--orders 8]
"""

from __future__ import annotations

import argparse
import asyncio
import heapq
import itertools
import random
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

sys.path.insert(0, str(Path(__file__).parents[2]))
from roboglot.kernels.distance import distances
from roboglot.kernels.search import ways_from
from roboglot.model.geometry import Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.simulation.bodies.files import load_body
from tests.meeting import WORLDS, Scenario, scenario, survey

TICK = 0.05  # s
STEP = 0.1  # m between two cells: two ticks at 1 m/s; three along a diagonal
BETWEEN, BESIDE = 0.1, 0.05  # m kept between two hulls, and from walls
NEAR = 5  # cells around a start or goal in which its cell is looked for
STATES_MAX = 150_000  # an order in which a robot needs more is given up
FOREVER = 1 << 30
MOVES = tuple((r, c, 2 if 0 in (r, c) else 3) for r, c in itertools.product((-1, 0, 1), repeat=2) if (r, c) != (0, 0))

Cell = tuple[int, int]
Track = list[tuple[int, Cell]]  # ticks of arrival; the robot waits in the cell before


@dataclass(frozen=True)
class Trip:
    """Trip of one robot: the cells that it may enter, where it goes, and the ticks from each cell to each goal."""

    radius: float
    free: NDArray[np.bool_]
    start: Cell
    goals: tuple[Cell, ...]
    ahead: tuple[NDArray[np.float32], ...]


def trips(scene: Scenario, grid: OccupancyGrid) -> list[Trip]:
    """Return the trips of all robots of a scenario."""
    away = distances((grid.log_odds >= 0).astype(np.uint8), 20.0)[::2, ::2] * grid.resolution
    found = []
    for body, start, goals in zip(scene.bodies, scene.starts, scene.goals, strict=True):
        radius = load_body(body).hull.radius
        free = away > radius + BESIDE
        cells = [_cell(pose, grid, free) for pose in (start, *goals)]
        cost = np.where(free, np.float32(1.0), np.float32(np.inf))
        ahead = [np.floor(2.0 * ways_from(cost, *cell)) for cell in cells[1:]]
        after = 0.0
        for number in reversed(range(len(ahead))):
            ahead[number] = ahead[number] + np.float32(after)
            after = float(ahead[number][cells[number]])
        found.append(Trip(radius, free, cells[0], tuple(cells[1:]), tuple(ahead)))
    return found


def _cell(pose: Pose, grid: OccupancyGrid, free: NDArray[np.bool_]) -> Cell:
    """Return the free cell nearest to ``pose``."""
    row, column = round((pose.y - grid.origin.y) / STEP), round((pose.x - grid.origin.x) / STEP)
    around = itertools.product(range(-NEAR, NEAR + 1), repeat=2)
    near = sorted((r * r + c * c, row + r, column + c) for r, c in around if free[row + r, column + c])
    return near[0][1], near[0][2]


class Booked:
    """Ticks in which cells are taken by the robots planned so far, for a hull of ``radius``."""

    def __init__(self, radius: float, others: Sequence[tuple[float, Track]], shape: Cell) -> None:
        self._width = shape[1]
        taken: dict[int, list[tuple[int, int]]] = {}
        for other, track in others:
            reach = (radius + other + BETWEEN) / STEP
            far = int(reach)
            disc = [(r, c) for r, c in itertools.product(range(-far, far + 1), repeat=2) if r * r + c * c < reach**2]
            for begin, end, (row, column) in _stays(track):
                for r, c in disc:
                    taken.setdefault((row + r) * self._width + column + c, []).append((begin, end))
        self._open = {cell: _gaps(spans) for cell, spans in taken.items()}

    def open(self, cell: Cell) -> list[tuple[int, int]]:
        """Return the spans of ticks, in order, in which ``cell`` is open."""
        return self._open.get(cell[0] * self._width + cell[1], [(0, FOREVER)])


def _stays(track: Track) -> Iterator[tuple[int, int, Cell]]:
    """Yield from when to when the robot is in, or on its way to or from, each cell."""
    for number, (arrives, cell) in enumerate(track):
        begin = arrives - 3 if number else 0
        yield begin, track[number + 1][0] if number + 1 < len(track) else FOREVER, cell


def _gaps(spans: list[tuple[int, int]]) -> list[tuple[int, int]]:
    free, at = [], 0
    for begin, end in sorted(spans):
        if begin > at:
            free.append((at, begin - 1))
        at = max(at, end + 1)
    return [*free, (at, FOREVER)] if at < FOREVER else free


def plan(trip: Trip, booked: Booked) -> Track | None:
    """Return the earliest track through all goals to stay at the last; None: none was found."""
    last = len(trip.goals) - 1
    first = (0, trip.start, 0)
    if not (spans := booked.open(trip.start)) or spans[0][0] > 0:
        return None
    queue: list[tuple[float, int, int, Cell, int]] = [(float(trip.ahead[0][trip.start]), 0, *first)]
    reached: dict[tuple[int, Cell, int], int] = {first: 0}
    before: dict[tuple[int, Cell, int], tuple[int, Cell, int]] = {}
    done = set[tuple[int, Cell, int]]()
    while queue and len(done) < STATES_MAX:
        _, now, leg, cell, span = heapq.heappop(queue)
        state = leg, cell, span
        if state in done:
            continue
        done.add(state)
        leaves = booked.open(cell)[span][1]
        if leg == last and cell == trip.goals[last] and leaves == FOREVER:
            return _track(state, before, reached)
        for r, c, ticks in MOVES:
            there = cell[0] + r, cell[1] + c
            if not trip.free[there]:
                continue
            onward = leg + (leg < last and there == trip.goals[leg])
            for other, (begin, end) in enumerate(booked.open(there)):
                arrives = max(now, begin) + ticks
                if arrives > leaves or begin > leaves:
                    break
                following = onward, there, other
                if arrives <= end and arrives < reached.get(following, FOREVER):
                    reached[following], before[following] = arrives, state
                    rest = float(trip.ahead[onward][there])
                    heapq.heappush(queue, (arrives + rest, arrives, *following))
    return None


def _track(
    state: tuple[int, Cell, int],
    before: dict[tuple[int, Cell, int], tuple[int, Cell, int]],
    reached: dict[tuple[int, Cell, int], int],
) -> Track:
    track = [(reached[state], state[1])]
    while state in before:
        state = before[state]
        track.append((reached[state], state[1]))
    return track[::-1]


def scheduled(ways: Sequence[Trip], order: Sequence[int]) -> int | None:
    """Return the sum of all ticks if robots are planned in this ``order``; None: one found no way."""
    others: list[tuple[float, Track]] = []
    for number in order:
        trip = ways[number]
        track = plan(trip, Booked(trip.radius, others, trip.free.shape))
        if track is None:
            return None
        others.append((trip.radius, track))
    return sum(track[-1][0] for _, track in others)


def best(ways: Sequence[Trip], alone: Sequence[int], orders: int, seed: int) -> int | None:
    """Return the least sum of ticks over some orders: longest first, shortest first, and changes of the best."""
    dice, numbers = random.Random(seed), range(len(ways))
    order = sorted(numbers, key=lambda number: -alone[number])
    least: int | None = None
    kept = order
    for count in range(orders):
        found = scheduled(ways, order)
        if found is not None and (least is None or found < least):
            least, kept = found, order
        if count == 0:
            order = order[::-1]
        elif least is None:
            order = dice.sample(order, len(order))
        else:
            order = list(kept)
            order.insert(dice.randrange(len(order)), order.pop(dice.randrange(len(order))))
    return least


def main(options: argparse.Namespace) -> None:
    maps = {world: asyncio.run(survey(world)) for world in WORLDS}
    sums: dict[str, list[int]] = {world: [0, 0] for world in WORLDS}
    for seed in range(options.first, options.first + options.scenarios):
        scene = scenario(seed)
        ways = trips(scene, maps[scene.world])
        tracks = [plan(trip, Booked(trip.radius, [], trip.free.shape)) for trip in ways]
        alone = [track[-1][0] for track in tracks if track is not None]
        together = best(ways, alone, options.orders, seed) if len(alone) == len(ways) else None
        if together is None:
            print(f"seed {seed}: no order of {options.orders} serves all")
            continue
        sums[scene.world][0] += sum(alone)
        sums[scene.world][1] += together
        print(f"seed {seed}: {TICK * (together - sum(alone)):.1f} s more than {TICK * sum(alone):.1f} s", flush=True)
    for world, (single, both) in sums.items():
        if single:
            print(f"{Path(world).stem}: {both / single:.3f} x alone")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--scenarios", type=int, default=4)
    parser.add_argument("--orders", type=int, default=8)
    main(parser.parse_args())
