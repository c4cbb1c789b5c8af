"""Tables of this door: frames by operation, filled by the chapters, and the manual's three tables of states."""

from __future__ import annotations

from collections.abc import Iterator

from roboglot.operations import OperationTable
from roboglot.programs.library.modules import MODULE_TRANSITIONS, ModuleOperation
from roboglot.programs.tasks.robot_modes import ALLOWED
from roboglot.programs.tasks.states import TRANSITIONS, TaskOperation
from roboglot.wire.visual.cloud import KINDS, RECORD

TABLE: OperationTable[str] = OperationTable("visual_frames")
ILLEGAL = "illegal"
ANSWERS = ("feedback", "block", "response")  # 0.2.1.2; roboglot.wire.visual.replies


def implemented() -> set[str]:
    """Return the implemented keys of the contract: frames by operation, and cells of the tables with their contents."""
    return {*_frames(), *_task_cells(), *_module_cells(), *_mode_cells()}


def partly() -> dict[str, str]:
    """Return nothing, as no row is implemented in part."""
    return {}


def _frames() -> Iterator[str]:
    yield from (operation.key for operation in TABLE)
    yield from (f"robot {answer}" for answer in ANSWERS)
    yield from (f"cloud {kind}" for kind in (*KINDS, RECORD))


def _task_cells() -> Iterator[str]:
    for state, row in TRANSITIONS.items():
        for operation in TaskOperation:
            yield f"task {state} x {operation}: {' '.join(row.get(operation, ())) or ILLEGAL}"


def _module_cells() -> Iterator[str]:
    for state, row in MODULE_TRANSITIONS.items():
        for operation in ModuleOperation:
            yield f"module {state} x {operation}: {' '.join(row.get(operation, ())) or ILLEGAL}"


def _mode_cells() -> Iterator[str]:
    for mode, allowed in ALLOWED.items():
        yield from (f"{mode} x {op}: {'legal' if op in allowed else ILLEGAL}" for op in TaskOperation)
