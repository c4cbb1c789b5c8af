"""Ways along the tracks of a map: a graph of their pieces, joined where they touch or cross. Knows no robot."""

from __future__ import annotations

import heapq
import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from roboglot.model.components.mapping.annotations import Line
from roboglot.model.errors import InvalidGoal
from roboglot.model.geometry import Point

JOIN = 0.1  # m between pieces that are joined
SAME = 1e-6  # m between two points that count as one
PIECES_MAX = CROSSINGS_MAX = 3000  # together half a second of a robot's time
_Points = NDArray[np.float64]


def way_along(tracks: Sequence[Line], start: Point, end: Point, *, directed: bool = False) -> list[Point]:
    """Return the way from ``start`` along tracks to ``end``, by the nearest track at both ends; empty if there is none.

    ``directed``: every track only from its start to its end. Raises InvalidGoal for too many tracks.
    """
    if sum(track.count() - 1 for track in tracks) > PIECES_MAX:
        raise InvalidGoal(f"the tracks have more than {PIECES_MAX} straight pieces")
    pieces = [(a, b) for track in tracks for a, b in pairwise(track.points()) if a.distance_to(b) > SAME]
    if not pieces:
        return []
    begins = np.array([(a.x, a.y) for a, _ in pieces])
    spans = np.array([(b.x - a.x, b.y - a.y) for a, b in pieces])
    on, off = (_nearest(begins, spans, np.array([p.x, p.y])) for p in (start, end))
    nodes = _clustered([on, off, *begins, *(begins + spans), *_crossings(begins, spans)])
    found = _shortest(_edges(nodes, begins, spans, directed=directed), _index(nodes, on), _index(nodes, off))
    if not found:
        return []
    way = [start, *(Point(*nodes[n].tolist()) for n in found), end]
    return [way[0], *(b for a, b in pairwise(way) if a.distance_to(b) > SAME)]


def through_tracks(tracks: Sequence[Line], start: Point, goals: Sequence[Point], *, strictly: bool) -> list[Point]:
    """Return ``goals``, each with a way there along the tracks' direction before it, if there is one.

    Raises InvalidGoal for too many tracks, and if ``strictly`` and there is no such way.
    """
    through = list[Point]()
    for goal in goals:
        way = way_along(tracks, start, goal, directed=True)
        if not way and strictly:
            raise InvalidGoal("no tracks lead there in the allowed direction")
        through += way[1:] or [goal]
        start = goal
    return through


def _shares(begins: _Points, spans: _Points, point: _Points) -> NDArray[np.float64]:
    """Return the share (0..1) along each piece that is nearest to ``point``."""
    shares: NDArray[np.float64] = ((point - begins) * spans).sum(axis=1) / (spans**2).sum(axis=1)
    return shares.clip(0.0, 1.0)


def _nearest(begins: _Points, spans: _Points, point: _Points) -> _Points:
    feet = begins + _shares(begins, spans, point)[:, None] * spans
    nearest: _Points = feet[int(np.argmin(np.hypot(*(feet - point).T)))]
    return nearest


def _crossings(begins: _Points, spans: _Points) -> list[_Points]:
    found: list[_Points] = []
    for i in range(len(begins) - 1):
        a, r, others, theirs = begins[i], spans[i], begins[i + 1 :], spans[i + 1 :]
        cross = r[0] * theirs[:, 1] - r[1] * theirs[:, 0]
        parallel = np.abs(cross) < 1e-9
        safe = np.where(parallel, 1.0, cross)
        gap = others - a
        t = (gap[:, 0] * theirs[:, 1] - gap[:, 1] * theirs[:, 0]) / safe
        u = (gap[:, 0] * r[1] - gap[:, 1] * r[0]) / safe
        hit = ~parallel & (t >= 0.0) & (t <= 1.0) & (u >= 0.0) & (u <= 1.0)
        found += [a + share * r for share in t[hit]]
        if len(found) > CROSSINGS_MAX:
            raise InvalidGoal(f"the tracks cross more than {CROSSINGS_MAX} times")
    return found


def _clustered(points: Sequence[_Points]) -> _Points:
    """Return the first of each cluster of points."""
    nodes: list[_Points] = []
    cells: dict[tuple[int, int], list[_Points]] = {}  # the nodes within JOIN of a point lie in the cells around its own
    for point in points:
        column, row = (int(at // JOIN) for at in point.tolist())
        near = [node for c in (-1, 0, 1) for r in (-1, 0, 1) for node in cells.get((column + c, row + r), ())]
        if all(math.dist(node, point) > JOIN for node in near):
            nodes.append(point)
            cells.setdefault((column, row), []).append(point)
    return np.array(nodes)


def _index(nodes: _Points, point: _Points) -> int:
    return int(np.argmin(np.hypot(*(nodes - point).T)))


def _edges(nodes: _Points, begins: _Points, spans: _Points, *, directed: bool) -> dict[int, dict[int, float]]:
    """Return the ways (m) from each node to the next ones along the pieces."""
    edges: dict[int, dict[int, float]] = {}
    for begin, span in zip(begins, spans, strict=True):
        shares = np.clip(((nodes - begin) @ span) / (span @ span), 0.0, 1.0)
        away = np.hypot(*(begin + shares[:, None] * span - nodes).T)
        touching = np.flatnonzero(away <= JOIN)
        order = touching[np.argsort(shares[touching], kind="stable")].tolist()
        for a, b in pairwise(order):
            length = math.hypot(*(nodes[b] - nodes[a]).tolist())
            edges.setdefault(a, {})[b] = length
            if not directed:
                edges.setdefault(b, {})[a] = length
    return edges


def _shortest(edges: dict[int, dict[int, float]], start: int, goal: int) -> list[int]:
    best, came = {start: 0.0}, {start: start}
    queue = [(0.0, start)]
    while queue:
        gone, here = heapq.heappop(queue)
        if here == goal:
            break
        if gone > best[here]:
            continue
        for there, length in edges.get(here, {}).items():
            if gone + length < best.get(there, math.inf):
                best[there], came[there] = gone + length, here
                heapq.heappush(queue, (gone + length, there))
    if goal not in came:
        return []
    way = [goal]
    while way[-1] != start:
        way.append(came[way[-1]])
    return way[::-1]
