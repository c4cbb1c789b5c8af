"""Loop closing: recognizes a place after a long way, then corrects all poses since, and rebuilds the map.

Keeps a scan about every half metre (keyframes), with their relative poses as a graph. A loaded map has no keyframes: it
stays unchanged, and matches with it constrain the new keyframes.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from roboglot.autonomy.slam.belief import Belief
from roboglot.autonomy.slam.evidence import EvidenceGrid
from roboglot.autonomy.slam.matcher import FREE, Match, fit, place
from roboglot.autonomy.slam.painting import paint
from roboglot.autonomy.slam.scan_points import ScanPoints
from roboglot.autonomy.slam.straightening import Edge, Straightening
from roboglot.model.components.mapping.localization import Region
from roboglot.model.geometry import Pose, wrap_angle
from roboglot.values import dataclass

log = logging.getLogger(__name__)

KEYFRAMES_MAX = 10_000
RAYS_KEPT_MAX = 400  # per scan
KEY_AFTER, KEY_AFTER_YAW = 0.4, math.radians(20.0)  # m, rad between two keyframes
SAME, SAME_YAW = 0.25, math.radians(15.0)  # m, rad around a keyframe within which no other is needed
WAY_MIN = 15.0  # m driven since the place was last seen
DRIFT, DRIFT_PER_METRE, DRIFT_MAX = 0.5, 0.05, 4.0  # m of possible drift after that distance
TURN_MAX = math.radians(25.0)
TRY_AFTER, TRUSTED_FOR = 1.0, 5.0  # m until the next attempt; after a place was found where expected
AROUND = 8  # keyframes before and after that form the local map
LOCAL_REACH = 6.0  # m from its centre
AGREEMENT, KNOWN_SHARE = 0.75, 0.5  # share of points that must fit, and that must lie on known ground
NEAR_SHARE = 0.2  # share of the points on the given map's ground from which a match with it is tried
SHARP = 0.04  # m: the match's standard deviation in the worst direction
AGREED, AGREED_YAW = 0.2, math.radians(3.0)  # difference between two sightings in a row
CORRECTED, CORRECTED_YAW = 0.06, math.radians(1.0)  # smaller corrections need no straightening
STEP_NOISE, STEP_YAW_NOISE = 0.02, math.radians(0.4)  # between keyframes, per root of a metre
LOOP_NOISE, LOOP_YAW_NOISE = 0.02, math.radians(0.3)


@dataclass(slots=True)
class Keyframe:
    """A scan, the pose of base_link (map) at that time, and the distance driven until then, m."""

    scan: ScanPoints
    pose: Pose
    way: float


@dataclass(frozen=True, slots=True)
class Sighting:
    """Keyframe ``first`` seen again from ``second``, at ``between`` in its frame; ``correction`` of the map there."""

    first: int
    second: int
    between: Pose
    correction: Pose


class LoopCloser:
    """Loop closer on the scans that are added to the map."""

    def __init__(self, belief: Belief) -> None:
        self._belief = belief
        self._map: EvidenceGrid | None = None
        self._begin(None)

    def _begin(self, grid: EvidenceGrid | None) -> None:
        """Forget all keyframes; ``grid`` has only its first scan, or was loaded."""
        self._map = grid
        self._given = grid.copy() if grid is not None and grid.scans != 1 else None  # the part that never moves
        self._held_at = 0.0  # m driven when the given map was last seen
        self._near = False  # whether the newest keyframe lies near the given map
        self._frames: list[Keyframe] = []
        self._table: NDArray[np.float64] = np.empty((64, 4))  # x, y, yaw and distance of the keyframes, with spare rows
        self._edges: list[Edge] = []
        self._work: Straightening | None = None
        self._last, self._next_try = 0, TRY_AFTER
        self._pending: Sighting | None = None
        self._full = False
        self.moved: Sequence[tuple[Pose, Pose]] = ()  # keyframe poses before and after the last straightening

    @property
    def keyframes(self) -> list[Pose]:
        """Current poses of all keyframes, in map."""
        return [frame.pose for frame in self._frames]

    @property
    def anchor(self) -> tuple[int, Pose] | None:
        """Number and pose of the robot's present keyframe; None before the first, and on another map."""
        if not self._frames or self._belief.map is not self._map:
            return None
        return self._last, self._frames[self._last].pose

    def note(self, scan: ScanPoints, pose: Pose, way: float) -> None:
        """Note a scan that was added at ``pose`` (map) after ``way`` m."""
        if self._belief.map is not self._map:
            self._begin(self._belief.map)
        if not self._is_new(pose):
            return
        if len(self._frames) >= KEYFRAMES_MAX:
            if not self._full:
                log.warning(
                    "the map will not be straightened any further: it has %d keyframes, the limit", KEYFRAMES_MAX
                )
            self._full = True
            return
        number = self._keep(Keyframe(scan.thinned(RAYS_KEPT_MAX), pose, way))
        if number:
            before = self._frames[self._last].pose
            length = math.sqrt(max(before.distance_to(pose), 0.1))
            self._edge(self._last, number, pose.relative_to(before), STEP_NOISE * length, STEP_YAW_NOISE * length)
        self._last = number
        if self._given is not None:
            self._hold(self._given, number, way)
        if not self._belief.closing_loops or self._work or (way < self._next_try and self._pending is None):
            return
        self._next_try = way + TRY_AFTER
        self._close(number)

    def advance(self, pose: Pose) -> Pose | None:
        """Continue straightening after a closed loop; return the robot's corrected ``pose`` at the end, else None."""
        if self._work is None:
            return None
        if self._belief.map is not self._map:
            self._work = None
            return None
        if not self._work.step():
            return None
        work, self._work = self._work, None
        local = pose.relative_to(self._frames[self._last].pose)
        self._apply(work)
        return self._frames[self._last].pose.compose(local)

    @property
    def straightening(self) -> bool:
        """True while a closed loop is being processed."""
        return self._work is not None and self._belief.map is self._map

    def _keep(self, frame: Keyframe) -> int:
        number = len(self._frames)
        self._frames.append(frame)
        if number == len(self._table):
            self._table = np.concatenate((self._table, np.empty_like(self._table)))
        self._table[number] = frame.pose.x, frame.pose.y, frame.pose.yaw, frame.way
        return number

    def _is_new(self, pose: Pose) -> bool:
        """Return whether a keyframe is needed here; otherwise an old one nearby becomes the present one."""
        if not self._frames:
            return True
        last = self._frames[self._last].pose
        if pose.distance_to(last) < KEY_AFTER and abs(wrap_angle(pose.yaw - last.yaw)) < KEY_AFTER_YAW:
            return False
        table = self._table[: len(self._frames)]
        near = np.hypot(table[:, 0] - pose.x, table[:, 1] - pose.y) < SAME
        for number in np.flatnonzero(near).tolist():
            if abs(wrap_angle(pose.yaw - self._frames[number].pose.yaw)) < SAME_YAW:
                self._last, self._pending = number, None
                return False
        return True

    def _hold(self, given: EvidenceGrid, number: int, way: float) -> None:
        """Tie keyframe ``number`` to the first one if the given map confirms its pose."""
        frame = self._frames[number]
        seen = fit(given, frame.scan, frame.pose, FREE, iterations=0)
        self._near = seen.known >= NEAR_SHARE * seen.points
        if seen.agreement < AGREEMENT or seen.known < KNOWN_SHARE * seen.points:
            return
        if not number or way - self._held_at < WAY_MIN:  # after a longer distance the map has to be found again
            self._held_at = way
            if number:
                self._edge(0, number, frame.pose.relative_to(self._frames[0].pose), LOOP_NOISE, LOOP_YAW_NOISE)

    def _edge(self, first: int, second: int, between: Pose, noise: float, yaw_noise: float) -> None:
        self._edges.append((first, second, between, noise**-2, yaw_noise**-2))

    def _close(self, number: int) -> None:
        seen = self._known_again(number)
        before, self._pending = self._pending, None
        if seen is None:
            return
        shift, turn = _size(seen.correction, self._frames[number].pose)
        if shift < CORRECTED and turn < CORRECTED_YAW:
            self._held_at = self._frames[number].way if seen.first == 0 else self._held_at
            self._edge(seen.first, seen.second, seen.between, LOOP_NOISE, LOOP_YAW_NOISE)
            self._next_try = self._frames[number].way + TRUSTED_FOR
            return
        if before is None or not self._agree(before, seen):
            self._pending = seen
            return
        for sighting in (before, seen):
            self._edge(sighting.first, sighting.second, sighting.between, LOOP_NOISE, LOOP_YAW_NOISE)
        frames = self._frames
        self._work = Straightening([f.scan for f in frames], [f.pose for f in frames], self._edges, self._given)

    def _known_again(self, number: int) -> Sighting | None:
        """Return the sighting of an old place from the newest keyframe; None: there is none."""
        frame = self._frames[number]
        reach = min(DRIFT_MAX, DRIFT + DRIFT_PER_METRE * frame.way)
        if self._given is not None and frame.way == self._held_at:
            return None
        if self._given is not None and self._near and frame.way - self._held_at > WAY_MIN:
            found = self._found(self._given, frame, reach)
            if found is not None:
                return self._sighting(0, number, found)
        table = self._table[:number]
        away = np.hypot(table[:, 0] - frame.pose.x, table[:, 1] - frame.pose.y)
        away[frame.way - table[:, 3] <= WAY_MIN] = math.inf
        near = int(away.argmin()) if number else 0
        if not number or away[near] > reach:
            return None
        found = self._found(self._local_map(near), frame, reach)
        return None if found is None else self._sighting(near, number, found)

    def _found(self, grid: EvidenceGrid, frame: Keyframe, reach: float) -> Pose | None:
        """Return the pose of ``frame`` in ``grid``, within ``reach`` m of the belief, if it is certain."""
        x, y = frame.pose.x, frame.pose.y
        found = place(grid, frame.scan, Region(x - reach, y - reach, x + reach, y + reach))
        return found.pose if found is not None and _is_certain(found, frame.pose) else None

    def _sighting(self, first: int, second: int, found: Pose) -> Sighting:
        between = found.relative_to(self._frames[first].pose)
        return Sighting(first, second, between, found.compose(self._frames[second].pose.inverse()))

    def _local_map(self, middle: int) -> EvidenceGrid:
        """Return a grid of the scans around keyframe ``middle``, in map."""
        grid, centre = EvidenceGrid(), self._frames[middle].pose
        for frame in self._frames[max(0, middle - AROUND) : middle + AROUND + 1]:
            if frame.pose.distance_to(centre) < LOCAL_REACH:
                paint(grid, frame.scan, frame.pose, fill=True)
        return grid

    def _agree(self, one: Sighting, other: Sighting) -> bool:
        """Return whether both corrections lead to the same pose."""
        here = self._frames[other.second].pose
        a, b = one.correction.compose(here), other.correction.compose(here)
        return a.distance_to(b) < AGREED and abs(wrap_angle(a.yaw - b.yaw)) < AGREED_YAW

    def _apply(self, work: Straightening) -> None:
        """Take over the straightened poses and map; later keyframes move with the newest straightened one."""
        count = len(work.after)
        self.moved = tuple(zip(work.before, work.after, strict=True))
        shift = work.after[-1].compose(work.before[-1].inverse())
        for number, frame in enumerate(self._frames):
            frame.pose = work.after[number] if number < count else shift.compose(frame.pose)
            self._table[number, :3] = frame.pose.x, frame.pose.y, frame.pose.yaw
            if number >= count:
                paint(work.grid, frame.scan, frame.pose, fill=True)
        self._held_at = self._frames[-1].way
        self._belief.map = self._map = work.grid
        self._belief.revision += 1


def _size(correction: Pose, here: Pose) -> tuple[float, float]:
    """Return the correction's shift (m) and turn (rad) at ``here``."""
    return correction.compose(here).distance_to(here), abs(correction.yaw)


def _is_certain(found: Match, believed: Pose) -> bool:
    """Return whether the scan fits in only one place, and well."""
    return (
        found.agreement >= AGREEMENT
        and found.known >= KNOWN_SHARE * found.points
        and found.sigma < SHARP
        and abs(wrap_angle(found.pose.yaw - believed.yaw)) < TURN_MAX
    )
