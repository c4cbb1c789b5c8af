"""The one algorithm task that a robot runs at a time: its state and its feedback. Knows no kind of task."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Awaitable, Callable, Mapping, Set

from roboglot.model.actions import Action
from roboglot.model.errors import RobotError
from roboglot.protocols.cyberdog.stream import Stream
from roboglot.values import dataclass
from roboglot.wire.cyberdog.codes import Feedback, TaskResult, TaskState, TaskType

log = logging.getLogger(__name__)
RUNS_AS = {
    TaskType.NAVIGATION: TaskState.NAVIGATING,
    TaskType.MAPPING: TaskState.MAPPING,
    TaskType.LOCALIZATION: TaskState.LOCALIZING,
    TaskType.DOCKING: TaskState.DOCKING,
    TaskType.VISION_FOLLOWING: TaskState.FOLLOWING,
    TaskType.UWB_FOLLOWING: TaskState.TAG_FOLLOWING,
}
OUTDOORS = {
    TaskState.NAVIGATING: TaskState.OUTDOOR_NAVIGATING,
    TaskState.MAPPING: TaskState.OUTDOOR_MAPPING,
    TaskState.LOCALIZATION_FAILED: TaskState.OUTDOOR_LOCALIZATION_FAILED,
    TaskState.LOCALIZING: TaskState.OUTDOOR_LOCALIZING,
    TaskState.LOCALIZED: TaskState.OUTDOOR_LOCALIZED,
}
KEEPS_LOCALIZATION = frozenset({TaskType.NAVIGATION, TaskType.DOCKING})
FAILED = {
    TaskState.LOCALIZED: TaskState.LOCALIZATION_FAILED,
    TaskState.OUTDOOR_LOCALIZED: TaskState.OUTDOOR_LOCALIZATION_FAILED,
}
NOT_LOCALIZED = frozenset({TaskState.IDLE, TaskState.LOCALIZATION_FAILED, TaskState.OUTDOOR_LOCALIZATION_FAILED})


@dataclass(frozen=True, slots=True)
class TaskRequest:
    """Request for a task: its kind, ``outdoor`` for an outdoor map, ``thing`` to follow an object, not a person."""

    kind: TaskType
    outdoor: bool = False
    thing: bool = False

    def there(self, state: TaskState) -> TaskState:
        """Return the variant of ``state`` for this request's kind of map."""
        return OUTDOORS.get(state, state) if self.outdoor else state

    @property
    def running(self) -> TaskState:
        """State while the task runs."""
        if self.thing:
            return TaskState.THING_FOLLOWING
        return self.there(RUNS_AS[self.kind])

    @property
    def begins_in(self) -> Set[TaskState]:
        """States in which it may begin: tasks are exclusive; navigation needs localization in that kind of map.

        Charging may begin without localization: the current map may know the dock.
        """
        match self.kind:
            case TaskType.NAVIGATION:
                return {self.there(TaskState.LOCALIZED)}
            case TaskType.DOCKING:
                return NOT_LOCALIZED | {TaskState.LOCALIZED, TaskState.OUTDOOR_LOCALIZED}
        return NOT_LOCALIZED


class Task:
    """One run of 6004."""

    def __init__(self, kind: TaskType) -> None:
        self.kind = kind
        self.stream = Stream()
        self.last: Feedback | None = None
        self.action: Action | None = None  # the action that moves the robot for it
        self.stopping = False
        self.stopped_as = TaskResult.CANCELED  # the result when it is stopped

    def feedback(self, code: Feedback, message: str = "") -> None:
        """Pass ``code`` on to the stream, with the reason of a failure in plain words."""
        if not self.stopping:
            self.last = code
            self.stream.send({"feedback_code": int(code), "feedback_msg": message})

    def fail(self, code: Feedback, error: Exception) -> TaskResult:
        """Report why the task failed, to the stream and in the log."""
        log.info("task %s failed: %s", self.kind.name, error)
        self.feedback(code, str(error))
        return TaskResult.FAILED


class Tasks:
    """The running task, and the state after its end."""

    def __init__(self) -> None:
        self.state = self._rest = TaskState.IDLE  # now, and when no task runs
        self._found_again: TaskState | None = None  # the state that follows when a lost pose is recovered
        self.current: Task | None = None
        self.on_change: list[Callable[[TaskState], None]] = []
        self._running: asyncio.Task[None] | None = None

    @property
    def last_feedback(self) -> int:
        """Last feedback of the task under way; 0 without one."""
        return int(self.current.last or 0) if self.current else 0

    def start(
        self, order: TaskRequest, run: Callable[[Task], Awaitable[TaskResult]], *, then: Mapping[TaskResult, TaskState]
    ) -> Task:
        """Run a task; its result selects the next state from ``then`` (default IDLE)."""
        kind = order.kind
        task = self.current = Task(kind)
        self._set_state(order.running)

        async def go() -> None:
            result = TaskResult.FAILED
            try:
                result = await run(task)
            except asyncio.CancelledError:
                result = TaskResult.CANCELED
                raise
            except RobotError as error:
                log.info("task %s failed: %s", kind.name, error)
            except Exception:
                log.exception("task %s crashed", kind.name)
            finally:
                result = task.stopped_as if task.stopping else result
                self.current = self._running = None
                if kind not in KEEPS_LOCALIZATION:
                    self._rest, self._found_again = order.there(then.get(result, TaskState.IDLE)), None
                self._set_state(self._rest)
                task.stream.end({"result": int(result)})

        self._running = asyncio.get_running_loop().create_task(go(), name=f"task {kind.name}")
        return task

    async def stop(self) -> None:
        """Cancel the task under way, if any; return once the robot stands."""
        task, running = self.current, self._running
        if task is None or running is None:
            return
        task.stopping = True
        self._set_state(TaskState.STOPPING)
        if task.action:
            task.action.cancel("stopped by the app")
            await task.action.done()
        running.cancel()
        await asyncio.gather(running, return_exceptions=True)

    async def close(self) -> None:
        """Cancel the task without waiting for the robot to stand."""
        if running := self._running:
            running.cancel()
            await asyncio.gather(running, return_exceptions=True)

    def leave(self) -> None:
        """Become idle: an earlier localization, or its failure, no longer counts."""
        self._rest, self._found_again = TaskState.IDLE, None
        if self.current is None:
            self._set_state(self._rest)

    def lose_place(self, reason: str) -> None:
        """Enter the state of failed localization, until ``find_place``."""
        if self._rest not in FAILED:
            return
        self._found_again, self._rest = self._rest, FAILED[self._rest]
        self._report_place(Feedback.LOCALIZATION_TRYING, reason)

    def find_place(self) -> None:
        """Leave the state of failed localization."""
        if self._found_again is None or FAILED[self._found_again] is not self._rest:
            return
        self._rest, self._found_again = self._found_again, None
        self._report_place(Feedback.LOCALIZATION_DONE, "")

    def _report_place(self, code: Feedback, message: str) -> None:
        if self.current is None:
            self._set_state(self._rest)
        elif self.current.kind in KEEPS_LOCALIZATION:
            self.current.feedback(code, message)

    def unbind(self) -> None:
        """End the app's streams; the task continues."""
        if self.current:
            self.current.stream.unbind()

    def _set_state(self, state: TaskState) -> None:
        if state is not self.state:
            self.state = state
            for listener in self.on_change:
                listener(state)
