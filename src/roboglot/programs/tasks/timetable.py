"""Next start of each task: its condition on the calendar of one time zone."""

from __future__ import annotations

import logging
from collections.abc import Callable
from datetime import tzinfo

from roboglot.model.clock import Clock
from roboglot.programs.errors import InvalidCondition, ProgramError
from roboglot.programs.stores import StoredProgram
from roboglot.programs.tasks.calendar import due_of
from roboglot.programs.tasks.schedule import Schedule
from roboglot.programs.tasks.states import TaskState
from roboglot.task_conditions import BadCondition

log = logging.getLogger(__name__)


class Timetable(Schedule):
    """The schedule of tasks. ``zone`` is the time zone of their conditions."""

    def __init__(self, clock: Clock, zone: tzinfo, fire: Callable[[str, float], None]) -> None:
        super().__init__(clock, fire)
        self._zone = zone

    def due(self, task: StoredProgram) -> float | None:
        """Return the task's next start, Unix s; None: never, or at server start. Raises InvalidCondition."""
        try:
            return due_of(task.mode, task.condition, self._clock.epoch(), self._zone)
        except BadCondition as error:
            raise InvalidCondition(f"condition: {error}") from None

    def wait(self, task: StoredProgram) -> None:
        """Let a task in run_wait wait for its time."""
        try:
            due = self.due(task) if task.mode == "cycle" else task.due or self._clock.epoch()
        except ProgramError as refusal:
            log.warning("task %s will not run: %s", task.id, refusal)
            return
        if due is not None:
            self.set(task.id, due)

    def wait_again(self, task: StoredProgram, state: TaskState) -> None:
        """Schedule an ended task again if it is a cycle."""
        if state is TaskState.RUN_WAIT:
            self.wait(task)
        else:
            self.drop(task.id)
