"""Excursions: separate maps while the pose in the old map is lost, joined to it when the pose is found again."""

from __future__ import annotations

import logging
import math
from collections import deque
from collections.abc import Callable

import numpy as np

from roboglot.autonomy.slam.belief import SURE, Belief
from roboglot.autonomy.slam.certainty import supported
from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.matcher import POINTS_MIN, fit
from roboglot.autonomy.slam.odometry.noise import LearntNoise
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.values import dataclass

log = logging.getLogger(__name__)

VIEWS_MAX = 1000  # per excursion: 300 m of driving, 20 MB
RAYS_KEPT_MAX = 400  # per view
VIEW_AFTER, VIEW_AFTER_YAW = 0.3, math.radians(20.0)  # m, rad between two views
MATCHED, KNOWN_SURE = 0.5, 0.6  # agreement of a match; share of known points from which less is a contradiction
WAY_MIN = 1.0  # m: on a shorter way the scans that found the place saw the same
JUDGED_MAX = 30  # views checked against the map
DENIED_AGREEMENT, DENIED_HIDDEN, JUDGED_SHARE = 0.5, 0.2, 0.3  # contradiction by the map, as for a lost pose
JOINED_AT_ONCE = 4  # views added per scan, so that the loop is not held up


@dataclass(frozen=True, slots=True)
class View:
    """A scan and the pose of base_link at that time, in the excursion's frame or in map."""

    scan: ScanPoints
    pose: Pose


class Excursion:
    """A separate map, with its origin at its first scan."""

    def __init__(self, noise: LearntNoise) -> None:
        self._noise = noise
        self._begin()

    def _begin(self) -> None:
        self._grid, self._pose, self._covariance = EvidenceGrid(), Pose(), np.diag(SURE)
        self._views: list[View] = []
        self._seen: Pose | None = None  # where the newest view was taken
        self.way = 0.0  # m

    def take(self, scan: ScanPoints, step: Pose, way: float, turn: float) -> None:
        """Move by odometry's ``step`` (in the last base_link; ``way`` m, ``turn`` rad), match, and keep views."""
        self._pose, self.way = self._pose.compose(step), self.way + way
        self._covariance = self._noise.spread(self._covariance, way, turn)
        if self._grid.scans:
            best = fit(self._grid, scan, self._pose, self._covariance)
            if best.fit >= POINTS_MIN and best.agreement >= MATCHED:
                self._pose, self._covariance = best.pose, best.covariance
            elif best.known >= KNOWN_SURE * best.points:  # it was carried: nothing links this view to the others
                self._begin()
        if self._seen is None or _is_apart(self._pose, self._seen):
            self._seen = self._pose
            paint(self._grid, scan, self._pose, fill=True)
            if len(self._views) < VIEWS_MAX:
                self._views.append(View(scan.thinned(RAYS_KEPT_MAX), self._pose))

    def placed(self, pose: Pose) -> list[View]:
        """Return the views in map, with the robot at ``pose`` now."""
        back = pose.compose(self._pose.inverse())
        return [View(view.scan, back.compose(view.pose)) for view in self._views]


class Excursions:
    """Begins an excursion when the pose is lost, and passes its views to ``add`` when the pose is known again."""

    def __init__(self, belief: Belief, noise: LearntNoise, add: Callable[[ScanPoints, Pose], None]) -> None:
        self._belief, self._noise, self._add = belief, noise, add
        self._now: Excursion | None = None
        self._joining: deque[View] = deque()
        self._map = belief.map

    def forget(self) -> None:
        """Drop the excursion, as a gap in the scans separates it from the next ones."""
        self._now = None

    def take(self, scan: ScanPoints, odometry: Pose, step: Pose, turn: float, *, sure: bool) -> None:
        """Take a scan after odometry's ``step``; ``sure``: scans may be added to the map."""
        belief = self._belief
        if belief.map is not self._map:
            self._map, self._now = belief.map, None
            self._joining.clear()
        if self._now is None and belief.lost is not None and belief.mapping and belief.map.scans:
            self._now = Excursion(self._noise)
        if self._now is not None:
            self._now.take(scan, step, math.hypot(step.x, step.y), turn)
            if belief.lost is None and sure:
                self._join(self._now, belief.map_to_odom.compose(odometry))
                self._now = None
        for _ in range(min(JOINED_AT_ONCE, len(self._joining))):
            view = self._joining.popleft()
            self._add(view.scan, view.pose)

    def _join(self, excursion: Excursion, pose: Pose) -> None:
        views = excursion.placed(pose)
        if excursion.way < WAY_MIN:
            return
        if any(self._is_denied(view) for view in views[:: math.ceil(len(views) / JUDGED_MAX)]):
            log.info("dropped %d scans taken while lost: they do not fit the map", len(views))
            return
        log.info("added %d scans taken while lost to the map: %.1f m", len(views), excursion.way)
        self._joining.extend(views)

    def _is_denied(self, view: View) -> bool:
        said = supported(self._map, view.scan, view.pose)
        judged = said.fitting + said.hidden + said.floating
        return said.hidden >= DENIED_HIDDEN * said.points or (
            said.agreement < DENIED_AGREEMENT and judged >= JUDGED_SHARE * said.points
        )


def _is_apart(pose: Pose, other: Pose) -> bool:
    return pose.distance_to(other) >= VIEW_AFTER or abs(wrap_angle(pose.yaw - other.yaw)) >= VIEW_AFTER_YAW
