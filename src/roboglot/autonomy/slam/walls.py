"""Echoes of things that surely stand still: straight surfaces wider than any robot. All others may move."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

WIDE = 0.9  # m; anything narrower may be a robot or a person
STRAIGHT = 0.06  # m off a line at most, noise included: the hull of a robot bends more over its width
LINK, LINK_SHARE = 0.25, 0.1  # m, share of the distance, between neighbouring echoes of one surface

Points = NDArray[np.float64]


def on_walls(points: Points) -> NDArray[np.bool_]:
    """Return which of ``points`` (n, 2; base_link, m; in the order of the scan) lie on such surfaces."""
    found = np.zeros(len(points), bool)
    if len(points) < 2:
        return found
    gaps = np.hypot(*np.diff(points, axis=0).T)
    breaks = np.flatnonzero(gaps > LINK + LINK_SHARE * np.hypot(points[1:, 0], points[1:, 1]))
    pieces = list(zip((0, *(breaks + 1).tolist()), (*breaks.tolist(), len(points) - 1), strict=True))
    while pieces:
        first, last = pieces.pop()
        piece, along = points[first : last + 1], points[last] - points[first]
        length = float(np.hypot(*along))
        if length < WIDE:  # or around a corner, and back
            if float(np.hypot(*np.ptp(piece, axis=0))) >= WIDE:
                _split(pieces, first, first + int(np.hypot(*(piece - piece[0]).T).argmax()), last)
            continue
        off = piece - piece[0]
        beside = np.abs(off[:, 0] * along[1] - off[:, 1] * along[0]) / length
        worst = int(beside.argmax())
        if beside[worst] <= STRAIGHT:
            found[first : last + 1] = True
        else:
            _split(pieces, first, first + worst, last)
    return found


def _split(pieces: list[tuple[int, int]], first: int, middle: int, last: int) -> None:
    if first < middle < last:
        pieces += [(first, middle), (middle, last)]
