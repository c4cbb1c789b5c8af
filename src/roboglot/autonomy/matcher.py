"""Scans against the map: the best pose near a prior, in a window, or anywhere. Moves no belief.

Needs the kernels, hence is imported only when they are loaded.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.belief import SURE
from roboglot.autonomy.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.scan_points import ScanPoints
from roboglot.kernels.matching import match
from roboglot.kernels.placing import best_place, pyramid, turned_offsets
from roboglot.kernels.relocation import correlate, likelihood_field
from roboglot.model.components.localization import Region
from roboglot.model.geometry import Pose, wrap_angle

ITERATIONS_MAX = 8
MATCH_POINTS_MAX = 200
POINTS_MIN = 15  # that must fit before a match is believed
KNOWN_SHARE = 0.4  # of all points; when fewer lie on known ground, quality suffers
SEARCH_STEP = math.radians(1.0)
SEARCH_POINTS_MAX = 90
SEARCH_RANGE_MAX = 12.0  # m
EDGE_COST = 0.1  # of a perfect score: what a pose at the edge of the window must fit better than one in its middle
FREE = np.diag((0.1**2, 0.1**2, 0.05**2))  # variances that leave the match to the scan
HEADINGS = 240  # tried when the robot may be anywhere
PYRAMID_LEVELS = 7
PLACE_POINTS_MAX = 100
PLACE_SHARE_MIN = 0.35  # of the highest score
PLACE_AGREEMENT = 0.7  # share of the points that must fit


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
) -> Match:
    """The best pose near ``prior`` (base_link in map), from ``start`` on; with 0 ``iterations`` the start, judged."""
    points, corner = scan.points, grid.corner
    if len(points) > MATCH_POINTS_MAX:
        points = np.ascontiguousarray(points[:: math.ceil(len(points) / MATCH_POINTS_MAX)])
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
    field = likelihood_field(np.ascontiguousarray(grid.evidence[row0:row1, col0:col1]))
    left, bottom = corner.x + col0 * RESOLUTION, corner.y + row0 * RESOLUTION
    start = np.array((centre.x - left, centre.y - bottom, centre.yaw))
    x, y, yaw, _ = correlate(
        field, _thinned(scan, SEARCH_POINTS_MAX), start, RESOLUTION, *window, SEARCH_STEP, EDGE_COST
    )
    return Pose(x + left, y + bottom, wrap_angle(yaw))


def place(grid: EvidenceGrid, scan: ScanPoints, region: Region | None) -> Match | None:
    """Where in the whole map (or in ``region`` of it) the scan fits, from the scan alone; None if nowhere."""
    points, corner = _thinned(scan, PLACE_POINTS_MAX), grid.corner
    floor = (grid.evidence < 0).astype(np.uint8)
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
    fields = pyramid(likelihood_field(grid.evidence), PYRAMID_LEVELS)
    offsets = turned_offsets(points, HEADINGS, RESOLUTION)
    enough = int(PLACE_SHARE_MIN * 255 * len(points))
    score, heading, row, col = best_place(fields, pyramid(floor, PYRAMID_LEVELS), offsets, enough)
    if score == 0:
        return None
    yaw = wrap_angle(math.tau * heading / HEADINGS)
    rough = Pose(corner.x + (col + 0.5) * RESOLUTION, corner.y + (row + 0.5) * RESOLUTION, yaw)
    best = fit(grid, scan, rough, FREE)
    return best if best.fit >= POINTS_MIN and best.agreement >= PLACE_AGREEMENT else None


def _thinned(scan: ScanPoints, most: int) -> NDArray[np.float64]:
    """At most so many of the points within range, evenly chosen."""
    near = scan.points[np.hypot(scan.points[:, 0], scan.points[:, 1]) < SEARCH_RANGE_MAX]
    return np.ascontiguousarray(near[:: max(1, math.ceil(len(near) / most))])
