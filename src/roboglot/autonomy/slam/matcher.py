"""Scans against the map: the best pose near a prior, in a window, or anywhere. Moves no belief.

Needs the kernels, hence is imported only when they are loaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import SURE
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.matching import gaps, match
from roboglot.kernels.occupancy import contradictions
from roboglot.kernels.placing import PlaceSearch, pyramid, turned_offsets
from roboglot.kernels.relocation import correlate, likelihood_field
from roboglot.model.components.mapping.localization import Region
from roboglot.model.geometry import Pose, wrap_angle

ITERATIONS_MAX = 8
MATCH_POINTS_MAX, ALL_POINTS = 200, 500
POINTS_MIN = 15  # that must fit before a match is believed
KNOWN_SHARE = 0.4  # of all points; when fewer lie on known ground, quality suffers
SEARCH_STEP = math.radians(1.0)
SEARCH_POINTS_MAX = 180
SEARCH_RANGE_MAX = 12.0  # m
UNKNOWN_SCORE = 50  # of 255, for a point where nothing is known: better than in floor that was seen free
EDGE_COST = 0.1  # of a perfect score: what a pose at the edge of the window must fit better than one in its middle
FREE = np.diag((0.1**2, 0.1**2, 0.05**2))  # variances that leave the match to the scan
HEADINGS = 240  # tried when the robot may be anywhere
PYRAMID_LEVELS = 7
PLACE_POINTS_MAX = 100
PLACE_SHARE_MIN = 0.35  # of the highest score
PLACE_AGREEMENT = 0.7  # share of the points that must fit, of those that the map supports or denies
PLACE_SUPPORTED, PLACE_KNOWN = 0.85, 0.75  # … by the map's walls and floor; share of all points that it must explain
PLACE_HIDDEN = 0.06  # … whose rays may pass through walls
SURE_SUPPORTED, SURE_KNOWN, SURE_HIDDEN = 0.94, 0.85, 0.02  # the same for a place to be believed by itself …
SURE_AGREEMENT, CLOSE, CLOSE_SHARE = 0.95, 0.04, 0.85  # … share of its points within so many m of a surface …
CROWDED_SUPPORTED, CROWDED_CLOSE = 0.88, 0.975  # … or, of those that are not on people, and are near a surface
PLACES_MAX = 5  # that look alike are compared
APART, TURNED = 8, 10  # cells, headings between two of them
SAME, SAME_YAW = 0.3, math.radians(10.0)  # m, rad: nearer ones are one place
RIVAL_SCORE, RIVAL_FIT = 0.85, 0.9  # of the best: rough score, points that fit, from which a place is a rival
RIVAL_SUPPORTED = 0.06  # … and by how much less of it the map may support
JUDGED_POINTS_MAX = 120
SLACK = 0.15  # m that a point may lie off what the map shows


@dataclass(frozen=True, slots=True)
class Support:
    """Of ``points`` echoes, how many the map explains and how many it denies: behind walls, in free floor."""

    points: int
    fitting: int
    hidden: int
    floating: int

    @property
    def agreement(self) -> float:
        """Share of what the map explains of all that it has an opinion on; 1 where it has none."""
        judged = self.fitting + self.hidden + self.floating
        return self.fitting / judged if judged else 1.0

    @property
    def known(self) -> float:
        """Share of the points that the map has an opinion on."""
        return (self.fitting + self.hidden + self.floating) / max(1, self.points)


@dataclass(frozen=True, slots=True)
class Match:
    """A matched pose; ``strain``: squared distance from the prior in its standard deviations.

    ``fit`` of the ``points`` lie on surfaces, ``known`` on known ground.
    """

    pose: Pose
    covariance: NDArray[np.float64]
    strain: float
    fit: int
    known: int
    points: int

    @property
    def agreement(self) -> float:
        """Share of the points on known ground that fit."""
        return self.fit / max(self.known, POINTS_MIN)

    @property
    def quality(self) -> float:
        """The same, but less when hardly anything is known around."""
        return min(1.0, self.fit / max(self.known, KNOWN_SHARE * self.points))


def fit(
    grid: EvidenceGrid,
    scan: ScanPoints,
    prior: Pose,
    covariance: NDArray[np.float64],
    *,
    start: Pose | None = None,
    iterations: int = ITERATIONS_MAX,
    most: int = MATCH_POINTS_MAX,
) -> Match:
    """The best pose near ``prior`` (base_link in map), from ``start`` on; with 0 ``iterations`` the start, judged.

    At most so many of the points are used.
    """
    points, corner = scan.points, grid.corner
    if len(points) > most:
        points = np.ascontiguousarray(points[:: math.ceil(len(points) / most)])
    centre = np.array((prior.x - corner.x, prior.y - corner.y, prior.yaw))
    first = centre
    if start is not None:  # yaws near each other, so that their difference is the turn between them
        first = np.array((start.x - corner.x, start.y - corner.y, prior.yaw + wrap_angle(start.yaw - prior.yaw)))
    sensor = np.array((scan.sensor.x, scan.sensor.y))
    found, narrowed, strain, fitting, known = match(
        grid.surface, grid.evidence, points, first, centre, covariance, sensor, RESOLUTION, iterations
    )
    np.fill_diagonal(narrowed, np.maximum(np.diag(narrowed), SURE))
    x, y, yaw = found.tolist()
    return Match(Pose(x + corner.x, y + corner.y, wrap_angle(yaw)), narrowed, strain, fitting, known, len(points))


def search(grid: EvidenceGrid, scan: ScanPoints, centre: Pose, window: tuple[float, float]) -> Pose:
    """The pose within ``window`` (m, rad) of ``centre`` at which most points lie on occupied cells.

    Of poses that are about as good, the one nearer to the centre.
    """
    corner, half = grid.corner, (SEARCH_RANGE_MAX + window[0]) / RESOLUTION
    row, column = ((v - c) / RESOLUTION for v, c in ((centre.y, corner.y), (centre.x, corner.x)))
    height, width = grid.evidence.shape
    row0, row1 = (min(max(int(row + d), 0), height) for d in (-half, half))
    col0, col1 = (min(max(int(column + d), 0), width) for d in (-half, half))
    known = np.ascontiguousarray(grid.evidence[row0:row1, col0:col1])
    field = likelihood_field(known)
    field[(known == 0) & (field == 0)] = UNKNOWN_SCORE
    left, bottom = corner.x + col0 * RESOLUTION, corner.y + row0 * RESOLUTION
    start = np.array((centre.x - left, centre.y - bottom, centre.yaw))
    x, y, yaw, _ = correlate(
        field, _thinned(scan, SEARCH_POINTS_MAX), start, RESOLUTION, *window, SEARCH_STEP, EDGE_COST
    )
    return Pose(x + left, y + bottom, wrap_angle(yaw))


def supported(grid: EvidenceGrid, scan: ScanPoints, pose: Pose) -> Support:
    """What the map says of ``scan`` if it was taken with base_link at ``pose``."""
    points = scan.in_frame(pose, _thinned(scan, JUDGED_POINTS_MAX))
    corner = grid.corner
    sensor = pose.compose(Pose(scan.sensor.x, scan.sensor.y))
    points -= (corner.x, corner.y)
    fitting, hidden, floating = contradictions(
        grid.evidence, points, sensor.x - corner.x, sensor.y - corner.y, SLACK, RESOLUTION
    )
    return Support(len(points), fitting, hidden, floating)


def place(grid: EvidenceGrid, scan: ScanPoints, region: Region | None) -> Match | None:
    """Where in the whole map (or in ``region`` of it) the scan fits, from the scan alone; None if nowhere.

    The best of the ``places``, whether or not others look like it.
    """
    found = _candidates(grid, scan, region, 1)
    return found[0][0] if found else None


def places(
    grid: EvidenceGrid, scan: ScanPoints, region: Region | None, most: int = PLACES_MAX, known: Pose | None = None
) -> list[Match]:
    """The places in the map (or in ``region`` of it) that explain the scan about equally well, the best first.

    More than one: the scan alone does not say where the robot is. None: it is nowhere in the map, or at a place that
    the map knows too little of. In a ``region``, or at the pose where the robot is ``known`` to be, less is enough.
    """
    candidates = _candidates(grid, scan, region, most)
    if not candidates:
        return []
    least = candidates[0][1].agreement - RIVAL_SUPPORTED
    alike = [(match, said) for match, said in candidates if match.fit >= RIVAL_FIT * candidates[0][0].fit]
    alike = [(match, said) for match, said in alike if said.agreement >= least]
    found = [match for match, _ in alike]
    expected = region is not None or (known is not None and _is_same(found[0].pose, known))
    return found if len(found) > 1 or expected or _is_sure(grid, scan, *alike[0]) else []


def _candidates(grid: EvidenceGrid, scan: ScanPoints, region: Region | None, most: int) -> list[tuple[Match, Support]]:
    """Places where the scan may have been taken, and what the map says of it there; the best first."""
    points, corner = _thinned(scan, PLACE_POINTS_MAX), grid.corner
    if len(points) < POINTS_MIN:
        return []
    fields = grid.kept("fields", lambda: pyramid(likelihood_field(grid.evidence), PYRAMID_LEVELS))
    if region is None:
        floors = grid.kept("floors", lambda: pyramid(_floor(grid, None), PYRAMID_LEVELS))
    else:
        floors = pyramid(_floor(grid, region), PYRAMID_LEVELS)
    search = PlaceSearch(fields, floors, turned_offsets(points, HEADINGS, RESOLUTION), (APART, TURNED))
    enough = int(PLACE_SHARE_MIN * 255 * len(points))
    found: list[tuple[Match, Support]] = []
    for number in range(most):
        score, heading, row, col = search.next(enough)
        if score == 0:
            break
        enough = enough if number else max(enough, int(RIVAL_SCORE * score))
        yaw = wrap_angle(math.tau * heading / HEADINGS)
        rough = Pose(corner.x + (col + 0.5) * RESOLUTION, corner.y + (row + 0.5) * RESOLUTION, yaw)
        best = fit(grid, scan, rough, FREE)
        said = supported(grid, scan, best.pose)
        if _is_place(best, said) and not any(_is_same(best.pose, other.pose) for other, _ in found):
            found.append((best, said))
    return sorted(found, key=lambda place: -place[0].fit)


def _floor(grid: EvidenceGrid, region: Region | None) -> NDArray[np.uint8]:
    """1 where base_link may be."""
    floor, corner = (grid.evidence < 0).astype(np.uint8), grid.corner
    if region is not None:
        row0, col0, row1, col1 = (
            max(0, round((v - c) / RESOLUTION))
            for v, c in (
                (region.min_y, corner.y),
                (region.min_x, corner.x),
                (region.max_y, corner.y),
                (region.max_x, corner.x),
            )
        )
        floor[:row0], floor[row1:], floor[:, :col0], floor[:, col1:] = 0, 0, 0, 0
    return floor


def _is_place(found: Match, said: Support) -> bool:
    return (
        found.fit >= POINTS_MIN
        and found.agreement >= PLACE_AGREEMENT
        and said.agreement >= PLACE_SUPPORTED
        and said.fitting >= PLACE_KNOWN * said.points
        and said.hidden <= PLACE_HIDDEN * said.points
    )


def _is_sure(grid: EvidenceGrid, scan: ScanPoints, found: Match, said: Support) -> bool:
    """Whether it is the place, not one that looks like another which the map does not have."""
    if said.fitting < SURE_KNOWN * said.points or said.hidden > SURE_HIDDEN * said.points:
        return False
    close = _close_share(grid, scan, found.pose)
    alone = found.agreement >= SURE_AGREEMENT and said.agreement >= SURE_SUPPORTED and close >= CLOSE_SHARE
    return alone or (said.agreement >= CROWDED_SUPPORTED and close >= CROWDED_CLOSE)


def _close_share(grid: EvidenceGrid, scan: ScanPoints, pose: Pose) -> float:
    """Share of the points near a surface of the map that lie right on it."""
    corner, sensor = grid.corner, np.array((scan.sensor.x, scan.sensor.y))
    points = _thinned(scan, ALL_POINTS)
    x, y = pose.x - corner.x, pose.y - corner.y
    off = gaps(grid.surface, grid.evidence, points, x, y, pose.yaw, sensor, RESOLUTION)
    near = off[np.isfinite(off)]
    return float((near < CLOSE).mean()) if len(near) else 0.0


def _is_same(one: Pose, other: Pose) -> bool:
    return one.distance_to(other) < SAME and abs(wrap_angle(one.yaw - other.yaw)) < SAME_YAW


def _thinned(scan: ScanPoints, most: int) -> NDArray[np.float64]:
    """At most so many of the points within range, evenly chosen."""
    near = scan.points[np.hypot(scan.points[:, 0], scan.points[:, 1]) < SEARCH_RANGE_MAX]
    return np.ascontiguousarray(near[:: max(1, math.ceil(len(near) / most))])
