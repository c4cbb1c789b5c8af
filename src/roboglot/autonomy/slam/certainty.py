"""Certainty of a pose: compares a scan with the map point by point. Needs the kernels.

People and other things that are not on the map hide some of its walls, but their rays pass through none: clusters of
points on free floor are set aside, and the remaining points have to fit more closely.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.matching import gaps
from roboglot.kernels.occupancy import CROSSING, FITTING, FLOATING, HIDDEN, verdicts
from roboglot.model.geometry import Pose
from roboglot.values import dataclass

SLACK = 0.15  # m by which a point may miss the map's surfaces
JUDGED_POINTS_MAX, ALL_POINTS = 120, 500
APART, MISSED = 0.3, 3  # m; missing points between two that still belong to one object
THING_SIZE, THING_POINTS = 0.8, 3  # m at most, points at least, of an object that may stand in the way: a person
THINGS_MAX, THINGS_SHARE = 3, 0.4  # such objects around the robot, and the share of its view that they hide
INLIER, CLOSE = 0.08, 0.04  # m from the surface
WELL_KNOWN, SURE_WELL_KNOWN = 4.0, 0.5  # weight of a surface with many hits; share of points near such surfaces
SURE_FITTING, SURE_HIDDEN, SURE_FLOATING = 0.85, 0.02, 0.02  # shares of points required for a certain place …
SURE_AGREEMENT, SURE_CLOSE, SURE_SIGMA = 0.95, 0.925, 0.03  # … of those near a surface; m, in the worst direction
SURE_CROSSING = 0.02  # share of the points on one surface seen through another: doors, thin objects
CROWDED, CROWDED_CLOSE = 0.02, 0.975  # beyond this share set aside, the share of the rest that must be close
CLOSE_PER_HIDDEN = 4.0  # added to that for each share of rays that pass through walls
EXACT, EXACT_HIDDEN = 0.965, 0.004  # share of points close to surfaces from which a place beats …
OUTDONE = 0.08  # … rivals that have this much less
PAINTED, PAINTED_SHARE, PAINTED_POINTS = 12.0, 0.8, 200  # weight of a surface; share of points near such; points


@dataclass(frozen=True, slots=True)
class Support:
    """Support for a pose, as numbers of ``points``: ``fitting``, ``hidden`` by walls, ``floating`` on free floor."""

    points: int
    fitting: int
    hidden: int
    floating: int

    @property
    def agreement(self) -> float:
        """Share of fitting points among those on known cells; 1 if there are none."""
        judged = self.fitting + self.hidden + self.floating
        return self.fitting / judged if judged else 1.0

    @property
    def known(self) -> float:
        """Share of the points on known cells."""
        return (self.fitting + self.hidden + self.floating) / max(1, self.points)


@dataclass(frozen=True, slots=True)
class Look:
    """A scan at a place, as shares of points: ``aside``, set aside as ``things``; all others of the remaining points.

    ``agreement``, ``close``: within 8 and 4 cm, of the points near a ``well_known`` surface; ``exact``: within 4 cm of
    any surface; ``crossing``: on a surface seen through another one.
    """

    aside: float
    things: int
    fitting: float
    hidden: float
    floating: float
    well_known: float
    agreement: float
    close: float
    exact: float
    crossing: float

    def is_sure(self, sigma: float) -> bool:
        """Return whether this is the pose, and not a similar place outside the map.

        ``sigma``: standard deviation of the match in its worst direction, m.
        """
        if self.things > THINGS_MAX or self.aside > THINGS_SHARE or sigma > SURE_SIGMA:
            return False
        if self.crossing > SURE_CROSSING:
            return False
        if self.fitting < SURE_FITTING or self.hidden > SURE_HIDDEN or self.floating > SURE_FLOATING:
            return False
        if self.well_known < SURE_WELL_KNOWN and not self.is_undisputed:
            return False
        needed = CROWDED_CLOSE if self.aside > CROWDED else SURE_CLOSE
        return self.agreement >= SURE_AGREEMENT and self.close >= needed + CLOSE_PER_HIDDEN * self.hidden

    @property
    def is_undisputed(self) -> bool:
        """Return whether no ray contradicts the pose, which compensates for a map of few scans."""
        return self.aside + self.hidden + self.floating == 0.0 and self.close >= CROWDED_CLOSE

    @property
    def is_exact(self) -> bool:
        """Return whether nearly all points are close to surfaces, and almost no ray contradicts the pose."""
        return self.exact >= EXACT and self.hidden <= EXACT_HIDDEN and self.crossing <= SURE_CROSSING

    def is_outdone_by(self, other: Look) -> bool:
        """Return whether ``other`` is exact and this place clearly less so."""
        return other.is_exact and self.exact < other.exact - OUTDONE


def supported(grid: EvidenceGrid, scan: ScanPoints, pose: Pose) -> Support:
    """Return the map's support for ``scan`` taken with base_link at ``pose``."""
    said = _verdicts(grid, scan, pose, scan.nearby(JUDGED_POINTS_MAX))
    fitting, floating = (int(np.count_nonzero(said == kind)) for kind in (FITTING, FLOATING))
    hidden = int(np.count_nonzero((said == HIDDEN) | (said == CROSSING)))
    return Support(len(said), fitting, hidden, floating)


def look_at(grid: EvidenceGrid, scan: ScanPoints, pose: Pose) -> Look:
    """Return the agreement of all points of ``scan`` with ``pose``."""
    points, corner = scan.nearby(ALL_POINTS), grid.corner
    said = _verdicts(grid, scan, pose, points)
    sensor = np.array((scan.sensor.x, scan.sensor.y))
    x, y = pose.x - corner.x, pose.y - corner.y
    off, weight = gaps(grid.slots, grid.surfaces, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION).T
    things = _things(points, np.flatnonzero(said == FLOATING))
    rest = np.ones(len(points), bool)
    for thing in things:
        rest[thing] = False
    count, near = max(1, int(rest.sum())), off[rest & (weight >= WELL_KNOWN)]
    crossing = said == CROSSING
    fitting, floating, close = (said == FITTING) | crossing, said == FLOATING, off < CLOSE
    return Look(
        aside=1.0 - count / max(1, len(points)),
        things=sum(_count(points, thing) for thing in things),
        fitting=float((fitting & rest).sum()) / count,
        hidden=float((said == HIDDEN).mean()) if len(said) else 0.0,
        floating=float((floating & rest).sum()) / count,
        well_known=len(near) / count,
        agreement=float((near < INLIER).mean()) if len(near) else 0.0,
        close=float((near < CLOSE).mean()) if len(near) else 0.0,
        exact=float((close & rest).sum()) / count,
        crossing=float((crossing & rest).sum()) / count,
    )


def is_well_painted(grid: EvidenceGrid, scan: ScanPoints, pose: Pose) -> bool:
    """Return whether nearly all of ``scan`` lies on surfaces shown by many scans, not on moving things."""
    points, corner = np.ascontiguousarray(scan.points[:: max(1, len(scan.points) // PAINTED_POINTS)]), grid.corner
    sensor = np.array((scan.sensor.x, scan.sensor.y))
    x, y = pose.x - corner.x, pose.y - corner.y
    off, weight = gaps(grid.slots, grid.surfaces, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION).T
    return bool(np.count_nonzero((off < INLIER) & (weight >= PAINTED)) >= PAINTED_SHARE * len(points))


def _verdicts(grid: EvidenceGrid, scan: ScanPoints, pose: Pose, points: NDArray[np.float64]) -> NDArray[np.uint8]:
    """Return the map's verdict on each of ``points`` (n, 2; base_link)."""
    corner, sensor = grid.corner, pose.compose(Pose(scan.sensor.x, scan.sensor.y))
    ends = scan.in_frame(pose, points)
    ends -= (corner.x, corner.y)
    found: NDArray[np.uint8] = verdicts(
        grid.evidence, ends, sensor.x - corner.x, sensor.y - corner.y, SLACK, RESOLUTION
    )
    return found


def _things(points: NDArray[np.float64], floating: NDArray[np.intp]) -> list[list[int]]:
    """Return clusters of ``floating`` points (numbers) of the size of a person or a few."""
    groups: list[list[int]] = []
    for number in floating.tolist():
        last = groups[-1][-1] if groups else -1
        if groups and number - last <= MISSED and np.hypot(*(points[number] - points[last])) < APART:
            groups[-1].append(number)
        else:
            groups.append([number])
    if len(groups) > 1 and np.hypot(*(points[groups[0][0]] - points[groups[-1][-1]])) < APART:  # behind the robot
        groups[0] = groups.pop() + groups[0]
    return [group for group in groups if len(group) >= THING_POINTS and _count(points, group) <= THINGS_MAX]


def _count(points: NDArray[np.float64], group: list[int]) -> int:
    """Return the number of things in a cluster: people may stand side by side."""
    return math.ceil(float(np.hypot(*np.ptp(points[group], 0))) / THING_SIZE)
