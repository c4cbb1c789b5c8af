"""Straightens the keyframes after a closed loop and rebuilds the map, a slice at every scan.

The robot uses the old map meanwhile; a slice takes some milliseconds at most, for maps of any size.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.evidence import RESOLUTION, EvidenceGrid
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.kernels.graph import relaxed
from roboglot.model.geometry import Pose, wrap_angle

ITERATIONS_MAX = 20
SETTLED = 1e-4  # m, rad: iterations end when no pose moves farther
PAINTED_AT_ONCE = 250_000  # cells crossed by rays, per step
COPIED_AT_ONCE = 400_000  # cells of a given map, per step

Edge = tuple[int, int, Pose, float, float]  # two keyframes, the second in the frame of the first, weights of m and rad


class Straightening:
    """One straightening: first the poses, then the map, which begins as a copy of ``given``, if there is one."""

    def __init__(
        self, scans: Sequence[ScanPoints], poses: Sequence[Pose], edges: Sequence[Edge], given: EvidenceGrid | None
    ) -> None:
        self._scans, self.before = tuple(scans), tuple(poses)
        self._poses = np.array([(pose.x, pose.y, pose.yaw) for pose in poses])
        self._pairs = np.array([edge[:2] for edge in edges], np.int32)
        self._measured = np.array([(b.x, b.y, b.yaw) for _, _, b, _, _ in edges])
        self._weights = np.array([(w, w, v) for _, _, _, w, v in edges])
        self._given, self._copied = given, 0
        self._iterations = 0
        self._painted = -1  # keyframes painted so far; negative while the poses are not settled
        self.after: Sequence[Pose] = ()
        self.grid = EvidenceGrid()

    def step(self) -> bool:
        """Do a slice of the work; return whether it was the last one."""
        if self._painted < 0:
            self._relax()
        elif self._given is not None and self._copied < self._given.evidence.shape[0]:
            self._copy(self._given)
        else:
            self._paint()
        return self._painted >= len(self._scans)

    def _paint(self) -> None:
        cells = 0.0
        while self._painted < len(self._scans) and cells < PAINTED_AT_ONCE:
            scan = self._scans[self._painted]
            paint(self.grid, scan, self.after[self._painted], fill=True)
            cells += float(np.hypot(scan.ends[:, 0], scan.ends[:, 1]).sum()) / RESOLUTION
            self._painted += 1

    def _relax(self) -> None:
        moved: NDArray[np.float64] = relaxed(self._poses, self._pairs, self._measured, self._weights, 1)
        farthest = float(np.abs(moved - self._poses).max())
        self._poses, self._iterations = moved, self._iterations + 1
        if farthest >= SETTLED and self._iterations < ITERATIONS_MAX:
            return
        self.after = tuple(Pose(x, y, wrap_angle(yaw)) for x, y, yaw in moved.tolist())
        self._painted = 0
        if self._given is None:
            self._make_room()
        else:
            self.grid = self._given.empty_like()

    def _make_room(self) -> None:
        """Grow the map to its final size at once, as growing copies it."""
        reach = max(float(np.abs(scan.ends).max()) for scan in self._scans) * 1.5
        x, y = self._poses[:, 0], self._poses[:, 1]
        self.grid.make_room(*(float(v) for v in (x.min() - reach, y.min() - reach, x.max() + reach, y.max() + reach)))

    def _copy(self, given: EvidenceGrid) -> None:
        rows = slice(self._copied, self._copied + max(1, COPIED_AT_ONCE // max(1, given.evidence.shape[1])))
        self.grid.copy_rows(given, rows)
        self._copied = rows.stop
