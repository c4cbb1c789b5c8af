"""Relocalization (6004 type 7) and navigation (type 1); poses as pushes 6005."""

from __future__ import annotations

from collections.abc import Sequence

from roboglot.drivers.cyberdog.chapters.mapping.tasks import Begin, Skills
from roboglot.model.actions import Action
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.components.motion.navigation import NAVIGATE, Navigation, NavigationOptions, check_goals
from roboglot.model.errors import Refused
from roboglot.model.geometry import Path, Point, Pose

GOALS_MAX = 100
FRESH = 1.0  # s: maximum age of a pose for the dog to count as localized


class CyberDogNavigation(Navigation):
    """Navigation by task 6004, type 1; the dog has to be localized."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    def navigate_to(self, goals: Sequence[Point], options: NavigationOptions, *, source: str = "") -> Action:
        check_goals(goals, options, most=GOALS_MAX)
        if options.speed_ratio < 1.0:
            raise Refused("this dog walks to goals at its own speed, not at a share of it")
        yaws = [None] * (len(goals) - 1) + [options.yaw]

        def begin(goal: Point, yaw: float | None) -> Begin:
            return lambda: self._skills.client.navigate(goal.x, goal.y, yaw)

        begins = [begin(goal, yaw) for goal, yaw in zip(goals, yaws, strict=True)]
        return self._skills.start(NAVIGATE, begins, goal=tuple(goals), source=source)

    async def plan(self, start: Point, goal: Point) -> Path:
        raise Refused("this robot does not report plans")

    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        raise Refused("this robot does not report plans")


class CyberDogLocalization(Localization):
    """Poses from pushes 6005; relocalization by task 6004, type 7."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    @property
    def pose(self) -> Pose:
        return self._skills.reported.advance_to(self._skills.robot.clock.time()).pose

    @property
    def quality(self) -> float:
        """1 while poses arrive, else 0: the dog reports no finer value."""
        return float(self.enabled)

    @property
    def enabled(self) -> bool:
        return self._skills.robot.clock.time() - self._skills.reported.pose_at < FRESH

    def enable(self, on: bool) -> None:
        if on is not self.enabled:
            raise Refused("this robot is localized by a task, not by a switch")

    def set_pose(self, pose: Pose) -> None:
        raise Refused("this robot finds its place by itself")

    def relocalize(self, region: Region | None = None, *, may_move: bool = False, source: str = "") -> Action:
        if region is not None:
            raise Refused("this robot searches the whole map")
        if may_move:
            raise Refused("this robot cannot drive by itself while it searches for its place")
        skills = self._skills
        return skills.start("relocalize", [skills.relocalize], goal=None, source=source, resource=LOCALIZATION)
