"""Tasks of the dog (6004): relocalization, navigation, docking; and its map."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Awaitable, Callable, Sequence

from roboglot.clients.cyberdog import CyberDogClient, CyberDogRefused, RunningTask
from roboglot.clients.errors import ClientError
from roboglot.drivers.cyberdog.state import ReportedState
from roboglot.drivers.cyberdog.vocabulary import robot_errors
from roboglot.model.actions import Action
from roboglot.model.components.motion.base import Base
from roboglot.model.components.motion.driving import BASE
from roboglot.model.components.motion.navigation import NavigationFeedback
from roboglot.model.components.system.link import Link
from roboglot.model.errors import Refused, Unconnected
from roboglot.model.robot import Robot
from roboglot.wire.cyberdog.codes import TaskState, TaskType

PERIOD = 0.1  # s between two polls
LOCALIZED = (TaskState.LOCALIZED, TaskState.OUTDOOR_LOCALIZED)

log = logging.getLogger(__name__)
Begin = Callable[[], Awaitable[RunningTask]]
Run = Callable[[Action], Awaitable[None]]
Afterwards = Callable[[RunningTask], Awaitable[None]]


class Skills:
    """Runs tasks of the dog as actions of the model."""

    def __init__(self, robot: Robot, client: CyberDogClient, link: Link, reported: ReportedState) -> None:
        self.robot, self.client, self.link, self.reported = robot, client, link, reported
        self.moving = 0  # our actions by which the dog moves itself
        self._orphan: TaskType | None = None  # still running since the link was lost

    def start(self, name: str, begins: Sequence[Begin], *, goal: object, source: str, resource: str = BASE) -> Action:
        """Start an action that runs one task after the other; the dog knows no pause, so a paused task begins again."""

        async def run(action: Action) -> None:
            for begin in begins:
                with robot_errors():
                    while not await self._follow(action, await begin()):
                        await action.hold(_stand)

        if resource == BASE:
            return self.start_moving(name, run, goal, source, pausable=True)
        self.link.require_free()
        return self.robot.actions.start(name, run, resources={resource}, goal=goal, source=source)

    def start_from_idle(
        self, name: str, begin: Begin, *, goal: object, source: str, then: Afterwards | None = None
    ) -> Action:
        """Start a task that the dog accepts only while not localized; relocalize afterwards."""

        async def run(action: Action) -> None:
            with robot_errors():
                localized = await self._leave_the_map()
                try:
                    await self._follow(action, await begin(), then)
                finally:
                    if localized:
                        await self._localize()

        return self.start_moving(name, run, goal, source)

    def start_moving(self, name: str, run: Run, goal: object, source: str, *, pausable: bool = False) -> Action:
        """Start an action by which the dog moves itself. Raises Refused if it is to be slower than it then is."""
        self.link.require_free()
        base = self.robot[Base]
        built = base.built.twist
        if base.limits.twist != built:
            raise Refused(f"this dog's own skills keep no speed limit below {built.x:g} m/s and {built.yaw:g} rad/s")

        async def counted(action: Action) -> None:
            self.moving += 1
            try:
                await run(action)
            finally:
                self.moving -= 1

        return self.robot.actions.start(name, counted, resources={BASE}, goal=goal, source=source, pausable=pausable)

    @property
    def localized(self) -> bool:
        """True if the dog reports that it knows its place and does nothing else."""
        beat = self.client.heartbeat
        return beat is not None and beat.task_status in LOCALIZED

    async def relocalize(self) -> RunningTask:
        """Begin the dog's search for its place; a localized dog accepts it only after it has left its map."""
        try:
            return await self.client.relocalise()
        except CyberDogRefused:
            if not self.localized:
                raise
        await self._leave_the_map()
        return await self.client.relocalise()

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
            (await self.client.relocalise()).leave()  # pose pushes show when it ends
        except ClientError as error:
            log.info("%s is not localized: %s", self.link.address, error)

    async def _follow(self, action: Action, task: RunningTask, then: Afterwards | None = None) -> bool:
        """Follow the task; return True when it has succeeded, False when it was stopped for a pause."""
        try:
            if then:
                await then(task)
            while not task.ended:
                if action.paused:
                    await self._stop(task)
                    return False
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
            return True
        except BaseException:
            if task.result is None:
                await self._stop(task)
            raise

    async def _stop(self, task: RunningTask) -> None:
        try:
            self.link.require()
            await task.cancel()
        except (ClientError, Unconnected):  # without a link the task continues until the link is back
            task.leave()
            self._orphan = task.kind


def _stand() -> None:
    """Do nothing: the dog stands once its task has been stopped."""
