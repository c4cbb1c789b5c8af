"""The dog's own skills, which are tasks of 6004: relocalisation, navigation, going to the dock; and its map."""

from __future__ import annotations

import math
from collections.abc import Awaitable, Callable, Sequence

from roboglot.clients.cyberdog import CyberDogClient, RunningTask
from roboglot.clients.errors import ClientError
from roboglot.drivers.cyberdog.newest import Newest
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.docking import Docking
from roboglot.model.components.driving import BASE, Driving
from roboglot.model.components.link import Link
from roboglot.model.components.localization import LOCALIZATION, Localization, Region
from roboglot.model.components.mapping import Mapping
from roboglot.model.components.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.errors import InvalidGoal, Refused
from roboglot.model.geometry import Path, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot

GOALS_MAX, POSITION_MAX = 100, 10_000.0
PERIOD = 0.1  # s between two looks
FRESH = 1.0  # s that a pose may be old for the dog to count as localized
OFF = 0.6  # m off the dock

Begin = Callable[[], Awaitable[RunningTask]]


class Skills:
    """Runs tasks of the dog as actions of the model."""

    def __init__(self, robot: Robot, client: CyberDogClient, link: Link, newest: Newest) -> None:
        self.robot, self.client, self.link, self.newest = robot, client, link, newest

    def start(
        self, name: str, begins: Sequence[Begin], *, goal: object, source: str, on_busy: OnBusy, resource: str = BASE
    ) -> Action:
        """One task after the other."""
        self.link.take(on_busy)

        async def run(action: Action) -> None:
            for begin in begins:
                with robot_errors():
                    await self._follow(action, await begin())

        return self.robot.actions.start(name, run, resources={resource}, goal=goal, source=source, on_busy=on_busy)

    async def _follow(self, action: Action, task: RunningTask) -> None:
        try:
            while not task.ended:
                self.link.require()
                remaining = self.newest.path
                action.report(
                    NavigationFeedback(
                        stage="driving" if remaining.points else "planning",
                        remaining=remaining,
                        milestones=(),
                        time_to_goal=0.0,
                    )
                )
                await self.robot.clock.sleep(PERIOD)
            await task.succeeded()
        except BaseException:
            if not task.ended:
                await _stop(task)
            raise


async def _stop(task: RunningTask) -> None:
    try:
        await task.cancel()
    except ClientError:  # the link is gone: the dog's own skill goes on
        task.leave()


class CyberDogNavigation(Navigation):
    """6004 type 1; the dog has to be localized."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    def navigate_to(
        self, goals: Sequence[Point], options: NavigationOptions, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE
    ) -> Action:
        if not 1 <= len(goals) <= GOALS_MAX:
            raise InvalidGoal(f"1 to {GOALS_MAX} goals, not {len(goals)}")
        if not all(math.hypot(goal.x, goal.y) <= POSITION_MAX for goal in goals):
            raise InvalidGoal("not a place on this map")
        yaws = [None] * (len(goals) - 1) + [options.yaw]

        def begin(goal: Point, yaw: float | None) -> Begin:
            return lambda: self._skills.client.navigate(goal.x, goal.y, yaw)

        begins = [begin(goal, yaw) for goal, yaw in zip(goals, yaws, strict=True)]
        return self._skills.start("navigate", begins, goal=tuple(goals), source=source, on_busy=on_busy)

    async def plan(self, start: Point, goal: Point) -> Path:
        raise Refused("this robot tells no plans")

    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        raise Refused("this robot tells no plans")


class CyberDogLocalization(Localization):
    """Pushes 6005, and 6004 type 7."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    @property
    def pose(self) -> Pose:
        return self._skills.newest.reckon(self._skills.robot.clock.time()).pose

    @property
    def quality(self) -> float:
        """1 while poses come, else 0: the dog tells no more."""
        return float(self.enabled)

    @property
    def enabled(self) -> bool:
        return self._skills.robot.clock.time() - self._skills.newest.told_at < FRESH

    def enable(self, on: bool) -> None:
        if on is not self.enabled:
            raise Refused("this robot is localized by a task, not by a switch")

    def set_pose(self, pose: Pose) -> None:
        raise Refused("this robot finds its place by itself")

    def relocalize(self, region: Region | None = None, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        if region is not None:
            raise Refused("this robot searches the whole map")
        client = self._skills.client
        return self._skills.start(
            "relocalize", [client.relocalise], goal=None, source=source, on_busy=on_busy, resource=LOCALIZATION
        )


class CyberDogMapping(Mapping):
    """Push 6001 and 6003: to be read alone."""

    def __init__(self, newest: Newest) -> None:
        self._newest = newest

    @property
    def grid(self) -> OccupancyGrid:
        return self._newest.grid

    @property
    def revision(self) -> int:
        return self._newest.revision

    @property
    def enabled(self) -> bool:
        return False

    def enable(self, on: bool) -> None:
        if on:
            raise Refused("this robot maps by a task of its app")

    @property
    def closes_loops(self) -> bool:
        return False

    def close_loops(self, on: bool) -> None:
        raise Refused("this robot does not tell")

    def clear(self) -> None:
        raise Refused("this robot's map is its app's")

    def load(self, grid: OccupancyGrid, pose: Pose) -> None:
        raise Refused("this robot's map is its app's")

    def move_origin(self, point: Point) -> Point:
        raise Refused("this robot's map is its app's")


class CyberDogDocking(Docking):
    """6004 type 9."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    @property
    def home(self) -> Pose | None:
        return None

    def set_home(self, pose: Pose | None) -> None:
        raise Refused("this robot finds its dock by itself")

    def dock(self, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        return self._skills.start("dock", [self._skills.client.charge], goal=None, source=source, on_busy=on_busy)

    def undock(self, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        if not self._skills.newest.docked:
            raise Refused("the robot is on no dock")
        return self._skills.robot[Driving].move_by(Pose(OFF), source=source, on_busy=on_busy)
