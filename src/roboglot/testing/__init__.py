"""The test kit: a simulated world on a virtual clock for your own tests.

Installed with the package as a pytest plugin::

    @pytest.mark.asyncio
    @pytest.mark.world("office")            # or "empty", or a path; this is the default
    async def test_drives(robot, world, forward):
        robot[Driving].move_by(Pose(x=1.0))
        await forward(seconds=5)
        assert_pose(world.truth.pose_of("a"), x=..., y=..., deg=0)
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import Protocol

from roboglot.model.geometry import Point, Pose, wrap_angle


class Forward(Protocol):
    """Advances robot time as fast as the machine can."""

    async def __call__(self, *, seconds: float) -> None: ...


def assert_pose(
    pose: Pose,
    *,
    x: float | None = None,
    y: float | None = None,
    deg: float | None = None,
    within: float = 0.05,
    within_deg: float = 2.0,
) -> None:
    """Fail unless ``pose`` is within ``within`` m of each given coordinate and ``within_deg`` degrees of ``deg``."""
    off = [f"{name} is {have:.3f}, not {want:.3f}" for name, have, want in (("x", pose.x, x), ("y", pose.y, y))
           if want is not None and abs(have - want) > within]  # fmt: skip
    if deg is not None and abs(math.degrees(wrap_angle(pose.yaw - math.radians(deg)))) > within_deg:
        off.append(f"yaw is {math.degrees(pose.yaw):.1f}, not {deg:.1f} degrees")
    assert not off, "; ".join(off)


def passed_in_order(track: Iterable[Point | Pose], goals: Sequence[Point], within: float) -> int:
    """Return the number of ``goals`` that a robot on ``track`` reached in their order, each to ``within`` m.

    The track is taken as straight between two points.
    """
    passed = 0
    for start, end in pairwise(track):
        while passed < len(goals) and _beside(goals[passed], start, end) <= within:
            passed += 1
    return passed


def _beside(place: Point, start: Point | Pose, end: Point | Pose) -> float:
    """Return the distance (m) from ``place`` to the segment from ``start`` to ``end``."""
    dx, dy = end.x - start.x, end.y - start.y
    share = ((place.x - start.x) * dx + (place.y - start.y) * dy) / max(dx * dx + dy * dy, 1e-12)
    share = min(1.0, max(0.0, share))
    return math.hypot(place.x - start.x - share * dx, place.y - start.y - share * dy)
