"""Errors of an estimated trajectory against a reference: absolute ones after alignment, and errors of relations.

A relation (Kümmerle et al. 2009) is the pose at one time relative to the pose at another; so a small error early in the
drive does not affect the errors after it.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from roboglot.datasets.drive_log import BadDriveLog
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.text_files import open_text
from roboglot.values import dataclass

RELATIONS_MAX = 1_000_000
NEAR_SECONDS = 0.5  # s between a relation's time stamp and the nearest pose

Stamped = Sequence[tuple[float, Pose]]


@dataclass(frozen=True, slots=True)
class Relation:
    """``between``: the pose at ``second`` in the frame of the pose at ``first`` (s)."""

    first: float
    second: float
    between: Pose


@dataclass(frozen=True, slots=True)
class RelationErrors:
    """Means and standard deviations over ``count`` relations: m, rad."""

    count: int
    shift: float
    shift_deviation: float
    turn: float
    turn_deviation: float


def absolute_error(estimated: Sequence[Pose], reference: Sequence[Pose]) -> float:
    """Return the RMS distance (m) between poses of the same times, after the best rigid alignment."""
    one = np.array([(pose.x, pose.y) for pose in estimated])
    other = np.array([(pose.x, pose.y) for pose in reference])
    off: NDArray[np.float64] = aligned(one, other) - other
    return math.sqrt(float((off**2).sum(axis=1).mean()))


def aligned(points: NDArray[np.float64], to: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return ``points`` (n, 2), rigidly aligned to ``to`` (n, 2) with the least squared distance."""
    middle, target = points.mean(axis=0), to.mean(axis=0)
    left, right = points - middle, to - target
    angle = math.atan2(float((left[:, 0] * right[:, 1] - left[:, 1] * right[:, 0]).sum()), float((left * right).sum()))
    c, s = math.cos(angle), math.sin(angle)
    turned: NDArray[np.float64] = left @ np.array([[c, s], [-s, c]]) + target
    return turned


def neighbour_relations(reference: Stamped) -> list[Relation]:
    """Return the relations from each pose of ``reference`` to the next."""
    return [
        Relation(before, after, there.relative_to(here))
        for (before, here), (after, there) in itertools.pairwise(reference)
    ]


def read_relations(path: Path) -> list[Relation]:
    """Read a file of relations: two stamps, then x y z roll pitch yaw of the second pose in the first's frame."""
    relations = []
    with open_text(path, "ascii", "replace") as lines:
        for number, line in enumerate(lines, 1):
            words = line.split()
            if not words or words[0].startswith("#"):
                continue
            try:
                first, second, x, y, _, _, _, yaw = map(float, words)
            except ValueError:
                raise BadDriveLog(f"{path.name}, line {number}: not two stamps and x y z roll pitch yaw") from None
            relations.append(Relation(first, second, Pose(x, y, wrap_angle(yaw))))
            if len(relations) > RELATIONS_MAX:
                raise BadDriveLog(f"{path.name}: more than {RELATIONS_MAX} relations")
    return relations


def relation_errors(estimated: Stamped, relations: Sequence[Relation]) -> RelationErrors:
    """Return the errors of the relations with an estimated pose near both times."""
    stamps = np.array([stamp for stamp, _ in estimated])
    shifts, turns = [], []
    for relation in relations:
        ends = [_nearest(stamps, stamp) for stamp in (relation.first, relation.second)]
        if None in ends:
            continue
        here, there = (estimated[k][1] for k in ends if k is not None)
        off = there.relative_to(here)
        shifts.append(off.distance_to(relation.between))
        turns.append(abs(wrap_angle(off.yaw - relation.between.yaw)))
    if not shifts:
        return RelationErrors(0, math.nan, math.nan, math.nan, math.nan)
    return RelationErrors(
        len(shifts), float(np.mean(shifts)), float(np.std(shifts)), float(np.mean(turns)), float(np.std(turns))
    )


def _nearest(stamps: NDArray[np.float64], stamp: float) -> int | None:
    k = int(np.searchsorted(stamps, stamp))
    best = min((i for i in (k - 1, k) if 0 <= i < len(stamps)), key=lambda i: abs(stamps[i] - stamp), default=None)
    return None if best is None or abs(stamps[best] - stamp) > NEAR_SECONDS else best
