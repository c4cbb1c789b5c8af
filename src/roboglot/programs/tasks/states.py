"""State machine of a task: its seven states, the ten operations, and the manual's table of both (0.2.2.1).

Pure data and one look-up; knows no program and no store.
"""

from __future__ import annotations

from enum import StrEnum

DEBUG = "debug"
"""The id of the one task that debug runs use."""


class TaskState(StrEnum):
    """State of a task. ``WAIT_RUN``: saved, waits for the user; ``RUN_WAIT``: registered, waits for its time."""

    NULL = "null"
    ERROR = "error"
    WAIT_RUN = "wait_run"
    RUN_WAIT = "run_wait"
    RUN = "run"
    SUSPEND = "suspend"
    SHUTDOWN = "shutdown"

    @property
    def alive(self) -> bool:
        """True while a program of this task exists."""
        return self in (TaskState.RUN, TaskState.SUSPEND)


class TaskOperation(StrEnum):
    """Operation on a task; ``START`` and ``STOP`` happen without a user."""

    INQUIRY = "inquiry"
    SAVE = "save"
    DELETE = "delete"
    DEBUG = "debug"
    RUN = "run"
    SUSPEND = "suspend"
    RECOVER = "recover"
    SHUTDOWN = "shutdown"
    START = "start"
    STOP = "stop"


# Two results: for save and debug (body is wrong, body is right); for shutdown and stop (cycle task, single task).
# An operation that a row does not contain is illegal in that state.
_TABLE: dict[str, dict[str, str]] = {
    "null": {"inquiry": "null", "save": "error wait_run", "delete": "null", "debug": "error run_wait"},
    "error": {"inquiry": "error", "save": "error wait_run", "delete": "null", "debug": "error run_wait"},
    "wait_run": {
        "inquiry": "wait_run",
        "save": "error wait_run",
        "delete": "null",
        "debug": "error run_wait",
        "run": "run_wait",
        "shutdown": "shutdown",
    },
    "run_wait": {"inquiry": "run_wait", "debug": "error run_wait", "shutdown": "shutdown", "start": "run"},
    "run": {
        "inquiry": "run",
        "debug": "error run_wait",
        "run": "run",
        "suspend": "suspend",
        "recover": "run",
        "shutdown": "run_wait shutdown",
        "start": "run",
        "stop": "run_wait shutdown",
    },
    "suspend": {
        "inquiry": "suspend",
        "debug": "error run_wait",
        "suspend": "suspend",
        "recover": "run",
        "shutdown": "run_wait shutdown",
        "stop": "run_wait shutdown",
    },
    "shutdown": {
        "inquiry": "shutdown",
        "save": "error wait_run",
        "delete": "null",
        "debug": "error run_wait",
        "run": "run_wait",
        "shutdown": "shutdown",
    },
}

TRANSITIONS: dict[TaskState, dict[TaskOperation, tuple[TaskState, ...]]] = {
    TaskState(state): {
        TaskOperation(operation): tuple(map(TaskState, results.split())) for operation, results in row.items()
    }
    for state, row in _TABLE.items()
}


def next_state(
    state: TaskState, operation: TaskOperation, *, mode: str = "single", correct: bool = True
) -> TaskState | None:
    """Return the state after ``operation``, or None if it is illegal.

    ``mode`` decides the state of an ended task, ``correct`` (the body passes the check) that of a saved one.
    """
    results = TRANSITIONS[state].get(operation)
    if not results:
        return None
    if operation in (TaskOperation.SAVE, TaskOperation.DEBUG):
        return results[-1 if correct else 0]
    return results[0 if mode == "cycle" else -1]


def state_after(state: TaskState, operation: TaskOperation, mode: str, *, correct: bool = True) -> TaskState:
    """Return the state after a legal operation."""
    following = next_state(state, operation, mode=mode, correct=correct)
    assert following is not None, f"{state} x {operation} was allowed"
    return following
