"""Modules: the manual's table (0.2.2.2) cell by cell, and the function that a module becomes."""

from __future__ import annotations

import ast

import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.programs.language import Problem, ProblemKind
from roboglot.programs.library.modules import (
    ModuleOperation,
    ModuleState,
    function_of,
    in_the_body,
    next_module_state,
)
from roboglot.task_conditions import Interface

# The vendor's words, shortened: 空状态, 错误状态, 正常状态, 非法操作.
WORDS = {"空": "null", "错": "error", "正": "normal"}
MANUAL = """
null   | 空 | 错正 | 非
error  | 错 | 错正 | 空
normal | 正 | 错正 | 空正
"""
CELLS = [
    (state.strip(), operation, cell.strip())
    for state, *cells in (line.split("|") for line in MANUAL.strip().splitlines())
    for operation, cell in zip(["inquiry", "save", "delete"], cells, strict=True)
]


@pytest.mark.parametrize(("state", "operation", "cell"), CELLS, ids=lambda value: value)
def test_every_cell_of_the_module_table(state: str, operation: str, cell: str) -> None:
    at = (ModuleState(state), ModuleOperation(operation))
    if operation == "save":
        results = [next_module_state(*at, correct=False), next_module_state(*at, correct=True)]
    else:
        results = [next_module_state(*at, used=False), next_module_state(*at, used=True)]
    expected = [None] if cell == "非" else [WORDS[word] for word in cell]
    assert results == (expected if len(expected) == 2 else expected * 2)


def test_table_has_no_more_cells_than_the_manual() -> None:
    assert len(CELLS) == len(ModuleState) * len(ModuleOperation) == 9


def test_module_is_a_function_one_line_below_users() -> None:
    text = function_of(Interface("say", ("name", "size")), "if size:\r\n    print(name)\n\nreturn size")
    assert text.split("\n") == ["def say(name, size):", "    if size:", "        print(name)", "", "    return size"]
    shown = in_the_body(Problem(3, 9, ProblemKind.NAME, "", ""))
    assert (shown.line, shown.column) == (2, 5)
    assert in_the_body(Problem(1, 2, ProblemKind.NAME, "", "")) == Problem(1, 1, ProblemKind.NAME, "", "")


@given(st.text(alphabet=" \n\r\tx=1:if()\\'\"#"))
def test_no_line_of_body_begins_left_of_function(body: str) -> None:
    function = function_of(Interface("f", ()), body)
    assert all(line.startswith("    ") or not line.strip() for line in function.split("\n")[1:])
    try:
        tree = ast.parse(function)
    except (SyntaxError, ValueError):
        return
    assert [type(node) for node in tree.body] == [ast.FunctionDef]
