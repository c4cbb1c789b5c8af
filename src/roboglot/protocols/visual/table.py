"""What of the frames and of the manual's three tables is there, for the coverage page; from the tables' own data."""

from __future__ import annotations

from collections.abc import Iterator

from roboglot.operations import Right
from roboglot.programs.library.modules import MODULE_TRANSITIONS, ModuleOperation
from roboglot.programs.tasks.robot_modes import ALLOWED
from roboglot.programs.tasks.states import TRANSITIONS, TaskOperation
from roboglot.wire.visual.cloud import KINDS, RECORD
from roboglot.wire.visual.requests import MODES, OPERATIONS, Kind, Request

ILLEGAL = "illegal"
ANSWERS = ("feedback", "block", "response")  # 0.2.1.2; roboglot.wire.visual.replies


def key_of(request: Request) -> str:
    """The contract's key of a frame's wish."""
    return f"{request.kind} {request.operate if request.kind in (Kind.TASK, Kind.MODULE) else request.mode}"


def right_of(request: Request) -> Right:
    """What a front end needs for a frame: looking is free to all who see."""
    return Right.SEE if request.operate == "inquiry" else Right.PROGRAM


def implemented() -> set[str]:
    """Keys of the contract: frames by what they ask for, cells with what they say."""
    return {*_frames(), *_task_cells(), *_module_cells(), *_mode_cells()}


def partly() -> dict[str, str]:
    """Nothing is there in part."""
    return {}


def _frames() -> Iterator[str]:
    for kind in (Kind.TASK, Kind.MODULE):
        yield from (f"{kind} {operation}" for operation in OPERATIONS[kind])
    for kind in (Kind.AI, Kind.SLAM):
        yield from (f"{kind} {mode}" for mode in MODES[kind])
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
