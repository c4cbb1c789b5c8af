"""Matches scans to the map: the best pose near a prior, in a window, or anywhere. Moves no belief.

Needs the kernels, so it is imported once they are loaded.
"""

from __future__ import annotations

import math
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import SURE, worst
from roboglot.autonomy.slam.certainty import SURE_SIGMA, THINGS_SHARE, Look, Support, look_at, supported
from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.scan_points import NEARBY, ScanPoints
from roboglot.kernels.matching import match
from roboglot.kernels.placing import PlaceSearch, correlate, likelihood_field, pyramid, turned_offsets
from roboglot.model.components.mapping.localization import Region
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.values import dataclass

ITERATIONS_MAX = 8
MATCH_POINTS_MAX = 400
POINTS_MIN = 15  # that must fit for a match to count
KNOWN_SHARE = 0.4  # of all points; with fewer on known ground, quality is reduced
SEARCH_STEP = math.radians(1.0)
SEARCH_POINTS_MAX = 180
WIDE = (0.5, math.radians(20.0))  # m, rad searched around a doubtful pose
SIGMAS = 3.0  # standard deviations of the prior that are searched …
CATCH, CATCH_YAW = 0.2, math.radians(8.0)  # m, rad: … when they exceed the range that a match converges from
REACH_MAX, REACH_YAW_MAX = 1.5, math.radians(45.0)  # m, rad searched at most after one step
UNKNOWN_SCORE = 50  # of 255, for a point on unknown ground: better than on floor seen free
EDGE_COST = 0.1  # of a perfect score: the advantage that a pose at the window's edge needs over its centre
LEAST = np.where(np.eye(3, dtype=bool), SURE, -np.inf)  # lower bounds of variances; covariances are unbounded
FREE = np.diag((0.1**2, 0.1**2, 0.05**2))  # variances of a prior that leaves the result to the scan
HEADINGS = 240  # tried when the robot may be anywhere
PYRAMID_LEVELS = 7
PLACE_POINTS_MAX = 100
PLACE_SHARE_MIN = 0.35  # of the highest score
PLACE_AGREEMENT = 0.7  # share of points that must fit, among those on known ground
PLACE_SUPPORTED, PLACE_KNOWN = 0.85, 0.75  # … by the map's walls and floor; share of all points that it must explain
PLACE_HIDDEN = 0.06  # … of rays that may pass through walls
PLACES_MAX = 5  # alike places that are compared
PLACES_TRIED = 20  # … before one of several counts as the only one
APART, TURNED = 8, 10  # cells, headings between two candidates
SAME, SAME_YAW = 0.3, math.radians(10.0)  # m, rad: closer candidates are one place
RIVAL_SCORE, RIVAL_FIT = 0.85, 0.9  # of the best: rough score, fitting points, from which a place is a rival
RIVAL_SUPPORTED = 0.06  # … and how much less of it the map may support


@dataclass(frozen=True, slots=True)
class Match:
    """A matched pose; ``strain``: squared distance from the prior in its standard deviations.

    ``covariance``: as the match claims it. ``fit``: number of the ``points`` on surfaces; ``known``: on known cells.
    ``stays``: how much of an error before stays; ``added``: covariance of what the match adds to it.
    """

    pose: Pose
    covariance: NDArray[np.float64]
    strain: float
    fit: int
    known: int
    points: int
    stays: NDArray[np.float64] = field(default_factory=lambda: np.zeros((3, 3)))
    added: NDArray[np.float64] = field(default_factory=lambda: np.diag(SURE))

    @property
    def agreement(self) -> float:
        """Share of fitting points among those on known cells."""
        return self.fit / max(self.known, POINTS_MIN)

    @property
    def sigma(self) -> float:
        """Standard deviation (m) of the position in its worst direction, if directions of surfaces were exact."""
        return worst(self.covariance)

    def doubt(self, before: NDArray[np.float64] = FREE) -> NDArray[np.float64]:
        """Return the covariance of the error (x, y, yaw), if it was ``before`` the match."""
        return np.maximum(self.stays @ before @ self.stays.T + self.added, LEAST)

    @property
    def quality(self) -> float:
        """Share of fitting points, reduced where few cells are known."""
        return min(1.0, self.fit / max(self.known, KNOWN_SHARE * self.points))


@dataclass(frozen=True, slots=True)
class Candidate:
    """A possible place of a scan, with the map's support for it."""

    match: Match
    said: Support
    look: Look

    @property
    def is_place(self) -> bool:
        """True if the scan fits well enough, even with people in view, to compare the place with others."""
        match, said, look = self.match, self.said, self.look
        if match.fit < POINTS_MIN or said.hidden > PLACE_HIDDEN * said.points:
            return False
        if look.is_exact:
            return look.aside <= THINGS_SHARE
        fits = match.agreement >= PLACE_AGREEMENT and said.agreement >= PLACE_SUPPORTED
        return fits and said.fitting >= PLACE_KNOWN * said.points


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
    """Return the best pose near ``prior`` (base_link in map), from ``start`` on; with 0 ``iterations`` the start.

    ``most``: the most points to use.
    """
    points, corner = scan.points, grid.corner
    if len(points) > most:
        points = np.ascontiguousarray(points[:: math.ceil(len(points) / most)])
    centre = np.array((prior.x - corner.x, prior.y - corner.y, prior.yaw))
    first = centre
    if start is not None:  # near each other, so that their difference is the turn between them
        first = np.array((start.x - corner.x, start.y - corner.y, prior.yaw + wrap_angle(start.yaw - prior.yaw)))
    sensor = np.array((scan.sensor.x, scan.sensor.y))
    found, narrowed, strain, fitting, known, stays, added = match(
        grid.slots, grid.surfaces, grid.evidence, points, first, centre, covariance, sensor, RESOLUTION, iterations
    )
    np.maximum(narrowed, LEAST, out=narrowed)
    x, y, yaw = found.tolist()
    pose = Pose(x + corner.x, y + corner.y, wrap_angle(yaw))
    return Match(pose, narrowed, strain, fitting, known, len(points), stays, added)


def start_of_match(grid: EvidenceGrid, scan: ScanPoints, before: Pose, covariance: NDArray[np.float64]) -> Pose:
    """Return the pose from which to match: ``before``, or the best one around it if ``covariance`` is too large."""
    x, y, yaw = (math.sqrt(covariance[k, k]) for k in range(3))
    reach, turn = SIGMAS * max(x, y), SIGMAS * yaw
    if reach < CATCH and turn < CATCH_YAW:
        return before
    window = min(max(reach, CATCH), REACH_MAX), min(max(turn, CATCH_YAW), REACH_YAW_MAX)
    return search(grid, scan, before, window)


def search(grid: EvidenceGrid, scan: ScanPoints, centre: Pose, window: tuple[float, float]) -> Pose:
    """Return the pose within ``window`` (m, rad) of ``centre`` with the most points on occupied cells.

    Of similarly good poses, the one nearest to the centre wins.
    """
    corner, half = grid.corner, (NEARBY + window[0]) / RESOLUTION
    row, column = ((v - c) / RESOLUTION for v, c in ((centre.y, corner.y), (centre.x, corner.x)))
    height, width = grid.evidence.shape
    row0, row1 = (min(max(int(row + d), 0), height) for d in (-half, half))
    col0, col1 = (min(max(int(column + d), 0), width) for d in (-half, half))
    known = np.ascontiguousarray(grid.evidence[row0:row1, col0:col1])
    field = likelihood_field(known)
    field[(known == 0) & (field == 0)] = UNKNOWN_SCORE
    left, bottom = corner.x + col0 * RESOLUTION, corner.y + row0 * RESOLUTION
    start = np.array((centre.x - left, centre.y - bottom, centre.yaw))
    x, y, yaw, _ = correlate(field, scan.nearby(SEARCH_POINTS_MAX), start, RESOLUTION, *window, SEARCH_STEP, EDGE_COST)
    return Pose(x + left, y + bottom, wrap_angle(yaw))


def place(grid: EvidenceGrid, scan: ScanPoints, region: Region | None) -> Match | None:
    """Return the best match in the whole map (or ``region``) by the scan alone; None: there is none.

    Other places may match equally well, unlike in ``places``.
    """
    found, _ = _candidates(grid, scan, region, 1)
    return found[0].match if found else None


def places(
    grid: EvidenceGrid, scan: ScanPoints, region: Region | None, most: int = PLACES_MAX, known: Pose | None = None
) -> list[Match]:
    """Return the places in the map (or ``region``) that explain the scan about equally well, the best first.

    Several places: the scan alone is ambiguous. None: the place is not on the map, or too little of it is known. In a
    ``region``, or at a pose that is ``known`` already, less certainty suffices, unless the scan fits better elsewhere.
    """
    candidates, complete = _candidates(grid, scan, region, most)
    elsewhere = _candidates(grid, scan, None, most)[0] if region is not None and candidates else []
    alike = _alike(candidates, elsewhere)
    if len(alike) == 1 < len(candidates) and not complete:
        candidates, complete = _candidates(grid, scan, region, PLACES_TRIED)
        alike = _alike(candidates, elsewhere)
        if not complete:  # more than are examined: one of the others may be better
            alike = candidates
    if not alike:
        return []
    expected = region is not None or (known is not None and alike[0].match.pose.is_near(known, SAME, SAME_YAW))
    sure = len(alike) > 1 or expected or alike[0].look.is_sure(alike[0].match.sigma)
    return [one.match for one in alike] if sure else []


def _alike(candidates: list[Candidate], elsewhere: list[Candidate]) -> list[Candidate]:
    """Return the ``candidates`` that explain the scan about as well as the best one, also of those ``elsewhere``.

    Each list has the best first.
    """
    if not candidates:
        return []
    best = max((*candidates, *elsewhere), key=lambda one: one.match.fit)
    first = best.said  # differences from a rival may lie on unknown ground
    least = first.agreement - RIVAL_SUPPORTED - (1.0 - first.known)
    alike = [one for one in candidates if one.match.fit >= RIVAL_FIT * best.match.fit]
    alike = [one for one in alike if one.said.agreement >= least]
    best = max((*alike, *elsewhere), key=lambda one: one.look.exact)
    if best.match.sigma <= SURE_SIGMA:
        alike = [one for one in alike if not one.look.is_outdone_by(best.look)]
    return alike


def _candidates(grid: EvidenceGrid, scan: ScanPoints, region: Region | None, most: int) -> tuple[list[Candidate], bool]:
    """Return possible places of the scan, the best first, and whether these are all.

    ``most``: the most places to examine.
    """
    points, corner = scan.nearby(PLACE_POINTS_MAX), grid.corner
    if len(points) < POINTS_MIN:
        return [], True
    fields = grid.kept("fields", lambda: pyramid(likelihood_field(grid.evidence), PYRAMID_LEVELS))
    if region is None:
        floors = grid.kept("floors", lambda: pyramid(_floor(grid, None), PYRAMID_LEVELS))
    else:
        floors = pyramid(_floor(grid, region), PYRAMID_LEVELS)
    search = PlaceSearch(fields, floors, turned_offsets(points, HEADINGS, RESOLUTION), (APART, TURNED))
    enough = int(PLACE_SHARE_MIN * 255 * len(points))
    found, score = list[Candidate](), 0
    for number in range(most):
        score, heading, row, col = search.next(enough)
        if score == 0:
            break
        enough = enough if number else max(enough, int(RIVAL_SCORE * score))
        yaw = wrap_angle(math.tau * heading / HEADINGS)
        rough = Pose(corner.x + (col + 0.5) * RESOLUTION, corner.y + (row + 0.5) * RESOLUTION, yaw)
        best = fit(grid, scan, rough, FREE)
        here = Candidate(best, supported(grid, scan, best.pose), look_at(grid, scan, best.pose))
        if here.is_place and not any(best.pose.is_near(other.match.pose, SAME, SAME_YAW) for other in found):
            found.append(here)
    return sorted(found, key=lambda one: -one.match.fit), score == 0


def _floor(grid: EvidenceGrid, region: Region | None) -> NDArray[np.uint8]:
    """Return a grid with 1 where base_link may be, else 0."""
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
