"""Requests to end or suspend tasks while a module restarts, which the manual refuses (0.2.2.3).

The robot stands until the module is up. No task may move it afterwards against such a request, so it is carried out
then.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Collection, Mapping
from contextlib import suppress

from roboglot.model.events import ModuleRestarted
from roboglot.model.robot import Robot
from roboglot.programs.errors import NotAllowed, ProgramError
from roboglot.programs.tasks.robot_modes import RobotMode, check_mode, mode_of
from roboglot.programs.tasks.runner import Background
from roboglot.programs.tasks.states import TaskOperation
from roboglot.programs.tasks.task_run import TaskRun

STOPS = (TaskOperation.SHUTDOWN, TaskOperation.SUSPEND)


class DeferredStops:
    """Remembers requests by the task's id until the restart is over."""

    def __init__(
        self,
        robot: Robot,
        runs: Mapping[str, TaskRun],
        background: Background,
        shutdown: Callable[[Collection[str], str], Awaitable[object]],
        suspend: Callable[[str], Awaitable[None]],
    ) -> None:
        """``shutdown`` and ``suspend`` carry out a request in ``background``."""
        self._robot, self._runs, self._background = robot, runs, background
        self._shutdown, self._suspend = shutdown, suspend
        self._requests: dict[str, TaskOperation] = {}
        self._reasons: dict[str, str] = {}
        self._leave: Callable[[], None] | None = None

    def check_mode(self, operation: TaskOperation, id: str, *, possible: bool) -> None:
        """Raise NotAllowed if the robot's mode forbids ``operation``; remember a stop that the task could obey."""
        try:
            check_mode(self._robot, operation)
        except NotAllowed as refusal:
            if not possible or operation not in STOPS or mode_of(self._robot) is not RobotMode.SET_UP:
                raise
            if self._requests.get(id) is not TaskOperation.SHUTDOWN:
                self._requests[id] = operation
            if self._leave is None:
                self._leave = self._robot.events.listen(ModuleRestarted, self._restarted)
            why = f"{refusal} It is carried out as soon as the module is up again."
            raise NotAllowed(why) from None

    def give_reason(self, ids: Collection[str], why: str) -> None:
        """Note the last line of the logs of tasks that are to end; empty: the usual one."""
        self._reasons |= {id: why for id in ids if id in self._requests and why}

    def close(self) -> None:
        """Forget all requests."""
        self._requests, self._reasons = {}, {}
        if self._leave is not None:
            self._leave()
            self._leave = None

    def _restarted(self, _: ModuleRestarted) -> None:
        requests, reasons = self._requests, self._reasons
        self.close()
        for id, request in requests.items():
            if request is TaskOperation.SUSPEND:
                self._background.add(_tried(self._suspend(id)), f"suspend {id}")
                continue
            if (run := self._runs.get(id)) is not None:  # at once: the base may move again
                run.is_ending = True
                run.call_off()
            self._background.add(_tried(self._shutdown([id], reasons.get(id, ""))), f"end {id}")


async def _tried(request: Awaitable[object]) -> None:
    """Carry out a request, unless its task has ended by itself."""
    with suppress(ProgramError):
        await request
