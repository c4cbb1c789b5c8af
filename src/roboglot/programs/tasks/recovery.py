"""Recovery of tasks that were running or suspended when the server ended. Starts nothing."""

from __future__ import annotations

import logging

from roboglot.programs.stores import LogEntry, Stores
from roboglot.programs.tasks.states import DEBUG, TaskState

log = logging.getLogger(__name__)


def settle(stores: Stores, now: float) -> dict[str, str]:
    """Settle tasks that ran when the server ended, at ``now`` (Unix s); return journal headers of those to continue."""
    left = stores.tasks.in_states_now([TaskState.RUN, TaskState.SUSPEND])
    # No front end is attached any more to watch a debug run.
    left += [task for task in stores.tasks.in_states_now([TaskState.RUN_WAIT]) if task.id == DEBUG]
    journals = stores.journals.headers_now()
    lost = {task.id: journals.pop(task.id) for task in left if task.id in journals and task.id != DEBUG}
    stores.journals.remove_now(journals)
    states = {task.id: "run_wait" if task.mode == "cycle" else "shutdown" for task in left if task.id not in lost}
    if states:
        log.warning("%d tasks were lost when the server ended: %s", len(states), ", ".join(states)[:500])
        words = "the server ended while the task was under way; it was not continued"
        stores.tasks.settle_now(states, LogEntry(now, "error", words))
    if lost:
        words = "the server ended while the task was under way; it is suspended: recover it to go on, or shut it down"
        entry = LogEntry(now, "note", words)
        stores.tasks.settle_now(dict.fromkeys(lost, TaskState.SUSPEND.value), entry)
    return lost
