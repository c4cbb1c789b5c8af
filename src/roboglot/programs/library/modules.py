"""Modules, functions that tasks and other modules call: states, the manual's table (0.2.2.2), and source text.

Pure data and text; knows no store and no robot.
"""

from __future__ import annotations

from dataclasses import replace
from enum import StrEnum

from roboglot.programs.language import Problem
from roboglot.task_conditions import Interface

HEADER_LINES = 1
"""Lines of a module's function before its body."""
INDENT = 4


class ModuleState(StrEnum):
    """State of a module; in ``ERROR`` it is stored, but cannot be called."""

    NULL = "null"
    ERROR = "error"
    NORMAL = "normal"


class ModuleOperation(StrEnum):
    """Operation of a user on a module."""

    INQUIRY = "inquiry"
    SAVE = "save"
    DELETE = "delete"


# Two results: for save (body is wrong, body is right); for delete (unused; used, and kept).
_TABLE = {
    "null": {"inquiry": "null", "save": "error normal"},
    "error": {"inquiry": "error", "save": "error normal", "delete": "null"},
    "normal": {"inquiry": "normal", "save": "error normal", "delete": "null normal"},
}

MODULE_TRANSITIONS: dict[ModuleState, dict[ModuleOperation, tuple[ModuleState, ...]]] = {
    ModuleState(state): {
        ModuleOperation(operation): tuple(map(ModuleState, results.split())) for operation, results in row.items()
    }
    for state, row in _TABLE.items()
}


def next_module_state(
    state: ModuleState, operation: ModuleOperation, *, correct: bool = True, used: bool = False
) -> ModuleState | None:
    """Return the state after ``operation``, or None if it is illegal.

    ``correct``: the body passes the check; ``used``: a task or module calls this one.
    """
    results = MODULE_TRANSITIONS[state].get(operation)
    if not results:
        return None
    if operation is ModuleOperation.SAVE:
        return results[-1 if correct else 0]
    return results[-1 if used else 0]


def function_of(interface: Interface, body: str) -> str:
    """Return the module as a Python function: one header line, the body indented by four blanks."""
    lines = body.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    indented = (" " * INDENT + line if line.strip() else line for line in lines)
    return "\n".join([f"def {interface.name}({', '.join(interface.parameters)}):", *indented])


def in_the_body(problem: Problem) -> Problem:
    """Return a problem of the function with its place in the user's body."""
    return replace(problem, line=max(1, problem.line - HEADER_LINES), column=max(1, problem.column - INDENT))
