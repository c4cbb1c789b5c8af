"""Tasks of the dog (6004): relocalization, navigation, docking; and its map."""

from __future__ import annotations

import contextlib
import logging
import math
from collections.abc import Awaitable, Callable, Sequence

from roboglot.clients.cyberdog import CyberDogClient, CyberDogRefused, RunningTask
from roboglot.clients.errors import ClientError
from roboglot.drivers.cyberdog.state import ReportedState
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.drivers.reported import ReportedMapping
from roboglot.model.actions import Action, OnBusy
from roboglot.model.components.mapping.localization import LOCALIZATION, Localization, Region
from roboglot.model.components.motion.docking import Docking
from roboglot.model.components.motion.driving import BASE, Driving
from roboglot.model.components.motion.navigation import Navigation, NavigationFeedback, NavigationOptions
from roboglot.model.components.system.link import Link
from roboglot.model.errors import InvalidGoal, Refused, Unconnected
from roboglot.model.geometry import Path, Point, Pose
from roboglot.model.maps import OccupancyGrid
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import TaskType

GOALS_MAX, POSITION_MAX = 100, 10_000.0
PERIOD = 0.1  # s between two polls
FRESH = 1.0  # s that a pose may be old for the dog to count as localized
OFF = 0.6  # m off the dock

log = logging.getLogger(__name__)
Begin = Callable[[], Awaitable[RunningTask]]
Afterwards = Callable[[RunningTask], Awaitable[None]]


class Skills:
    """Runs tasks of the dog as actions of the model."""

    def __init__(self, robot: Robot, client: CyberDogClient, link: Link, reported: ReportedState) -> None:
        self.robot, self.client, self.link, self.reported = robot, client, link, reported
        self._orphan: TaskType | None = None  # still runs after the link was lost

    def start(
        self, name: str, begins: Sequence[Begin], *, goal: object, source: str, on_busy: OnBusy, resource: str = BASE
    ) -> Action:
        """Start an action that runs one task after the other."""
        self.link.require_free()

        async def run(action: Action) -> None:
            for begin in begins:
                with robot_errors():
                    await self._follow(action, await begin())

        return self._begin(name, run, goal=goal, source=source, on_busy=on_busy, resource=resource)

    def start_from_idle(
        self, name: str, begin: Begin, *, goal: object, source: str, on_busy: OnBusy, then: Afterwards | None = None
    ) -> Action:
        """Start a task that the dog accepts only while not localized; relocalize afterwards."""
        self.link.require_free()

        async def run(action: Action) -> None:
            with robot_errors():
                localized = await self._leave_the_map()
                try:
                    await self._follow(action, await begin(), then)
                finally:
                    if localized:
                        await self._localize()

        return self._begin(name, run, goal=goal, source=source, on_busy=on_busy, resource=BASE)

    async def stop_orphan(self) -> bool:
        """Stop the orphaned task after a reconnection; return True if there was one. Raises ClientError."""
        if self._orphan is None:
            return False
        with contextlib.suppress(CyberDogRefused):
            await self.client.stop_task(self._orphan)
        self._orphan = None
        return True

    async def _leave_the_map(self) -> bool:
        """Stop the localization task; return True if one ran. Heartbeats would be too late to show it."""
        try:
            await self.client.stop_task()
        except CyberDogRefused:
            return False
        return True

    async def _localize(self) -> None:
        try:
            (await self.client.relocalise()).leave()  # pose pushes show its end
        except ClientError as error:
            log.info("%s is not localized: %s", self.link.address, error)

    def _begin(
        self,
        name: str,
        run: Callable[[Action], Awaitable[None]],
        *,
        goal: object,
        source: str,
        on_busy: OnBusy,
        resource: str,
    ) -> Action:
        return self.robot.actions.start(name, run, resources={resource}, goal=goal, source=source, on_busy=on_busy)

    async def _follow(self, action: Action, task: RunningTask, then: Afterwards | None = None) -> None:
        try:
            if then:
                await then(task)
            while not task.ended:
                self.link.require()
                remaining = self.reported.path
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
            if task.result is None:
                await self._stop(task)
            raise

    async def _stop(self, task: RunningTask) -> None:
        try:
            self.link.require()
            await task.cancel()
        except (ClientError, Unconnected):  # without a link the task goes on until it is back
            task.leave()
            self._orphan = task.kind


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
        raise Refused("this robot does not report plans")

    async def visiting_order(self, places: Sequence[Point], *, round_trip: bool = False) -> Sequence[int]:
        raise Refused("this robot does not report plans")


class CyberDogLocalization(Localization):
    """Pushes 6005, and 6004 type 7."""

    def __init__(self, skills: Skills) -> None:
        self._skills = skills

    @property
    def pose(self) -> Pose:
        return self._skills.reported.reckon(self._skills.robot.clock.time()).pose

    @property
    def quality(self) -> float:
        """Return 1 while poses arrive, else 0: the dog reports nothing finer."""
        return float(self.enabled)

    @property
    def enabled(self) -> bool:
        return self._skills.robot.clock.time() - self._skills.reported.pose_at < FRESH

    def enable(self, on: bool) -> None:
        if on is not self.enabled:
            raise Refused("this robot is localized by a task, not by a switch")

    def set_pose(self, pose: Pose) -> None:
        raise Refused("this robot finds its place by itself")

    def relocalize(
        self,
        region: Region | None = None,
        *,
        may_move: bool = False,
        source: str = "",
        on_busy: OnBusy = OnBusy.REPLACE,
    ) -> Action:
        if region is not None:
            raise Refused("this robot searches the whole map")
        client = self._skills.client
        return self._skills.start(
            "relocalize", [client.relocalise], goal=None, source=source, on_busy=on_busy, resource=LOCALIZATION
        )


class CyberDogMapping(ReportedMapping):
    """Pushes 6001 and 6003; read-only."""

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
        raise Refused("this robot does not report loop closure")

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
        charge = self._skills.client.charge
        return self._skills.start_from_idle("dock", charge, goal=None, source=source, on_busy=on_busy)

    def undock(self, *, source: str = "", on_busy: OnBusy = OnBusy.REPLACE) -> Action:
        if not self._skills.reported.docked:
            raise Refused("the robot is on no dock")
        return self._skills.robot[Driving].move_by(Pose(OFF), source=source, on_busy=on_busy)
