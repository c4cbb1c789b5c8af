"""Adding of scans to the map, if they show something new."""

from __future__ import annotations

import math

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.loops import LoopCloser
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.model.components.mapping.annotations import Annotations, AreaKind, MapAnnotations
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.model.robot import Robot

ADD_AFTER, ADD_AFTER_YAW, ADD_PERIOD = 0.15, math.radians(12.0), 1.0  # m, rad, s between two scans in the map
FILL_AFTER, FILL_AFTER_YAW = 0.4, math.radians(20.0)


class Adding:
    """Adds scans to the belief's map, and to the keyframes of loop closing."""

    def __init__(self, robot: Robot, belief: Belief, loops: LoopCloser) -> None:
        self._robot, self._belief, self._loops = robot, belief, loops
        self._added: Pose | None = None
        self._filled: Pose | None = None
        self._added_at = -math.inf

    def is_due(self, pose: Pose, stamp: float) -> bool:
        """Return whether a scan taken at ``pose`` (map) is to be added."""
        if not self._belief.map.scans or self._added is None:
            return True
        return _is_apart(pose, self._added, ADD_AFTER, ADD_AFTER_YAW) or stamp - self._added_at >= ADD_PERIOD - 1e-6

    def add(self, scan: ScanPoints, pose: Pose, stamp: float, way: float) -> None:
        """Add a scan just taken at ``pose`` (map), after ``way`` m."""
        fill = self._is_new_ground(pose)
        self._added, self._added_at = pose, stamp
        self.paint(scan, pose, way, fill=fill)

    def paint(self, scan: ScanPoints, pose: Pose, way: float, *, fill: bool = True) -> None:
        """Add a scan taken at ``pose`` (map) at any time; ``fill``: clear the floor between the rays, too."""
        belief = self._belief
        drawn = self._robot[MapAnnotations].current if MapAnnotations in self._robot else Annotations()
        maintained = drawn.areas_of(AreaKind.MAINTENANCE)
        scan = scan.beside(pose, belief.others)
        if not len(scan.ends):
            return
        paint(belief.map, scan, pose, fill=fill, maintained=maintained)
        belief.revision += 1
        if belief.localizing and not maintained:
            self._loops.note(scan, pose, way)

    def shift(self, pose: Pose) -> None:
        """Note that the newest scan is at ``pose`` on the straightened map."""
        self._added = self._filled = pose

    def _is_new_ground(self, pose: Pose) -> bool:
        """Return whether to clear the gaps between rays here: only some way after the last time."""
        last = self._filled if self._belief.map.scans > 1 else None
        if last and not _is_apart(pose, last, FILL_AFTER, FILL_AFTER_YAW):
            return False
        self._filled = pose
        return True


def _is_apart(pose: Pose, other: Pose, away: float, turned: float) -> bool:
    return pose.distance_to(other) >= away or abs(wrap_angle(pose.yaw - other.yaw)) >= turned
