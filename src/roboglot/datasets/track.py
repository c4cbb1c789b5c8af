"""Poses over time, interpolated at the stamps of the scans."""

from __future__ import annotations

from bisect import bisect_left
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from typing import TypeVar

from roboglot.model.geometry import Pose

APART_MAX = 1.0  # s between a scan and its odometry
T = TypeVar("T")


class Track:
    """Poses over time, interpolated."""

    def __init__(self) -> None:
        self._stamps: list[float] = []
        self._poses: list[Pose] = []

    def __len__(self) -> int:
        return len(self._stamps)

    def add(self, stamp: float, pose: Pose) -> None:
        """Append a pose; ignored unless ``stamp`` (s) is later than the last."""
        if not self._stamps or stamp > self._stamps[-1]:
            self._stamps.append(stamp)
            self._poses.append(pose)

    def at(self, stamp: float) -> Pose | None:
        """Return the interpolated pose at ``stamp`` (s); None without a pose within ``APART_MAX``."""
        index = bisect_left(self._stamps, stamp)
        if index == len(self._stamps):
            return self._poses[-1] if self._stamps and stamp - self._stamps[-1] < APART_MAX else None
        after, pose = self._stamps[index], self._poses[index]
        if index == 0:
            return pose if after - stamp < APART_MAX else None
        begin, first = self._stamps[index - 1], self._poses[index - 1]
        if after - begin > APART_MAX:
            return None
        share = (stamp - begin) / (after - begin)
        step = pose.relative_to(first)
        return first.compose(Pose(share * step.x, share * step.y, share * step.yaw))


def with_odometry(
    messages: Iterable[T], stamp_of: Callable[[T], float], track: Track, unread: Counter[str]
) -> Iterator[tuple[T, float, Pose]]:
    """Yield scans with their stamp (s) and odometry; scans without odometry are counted in ``unread``."""
    for message in messages:
        stamp = stamp_of(message)
        odometry = track.at(stamp)
        if odometry is None:
            unread["scans without odometry"] += 1
        else:
            yield message, stamp, odometry
