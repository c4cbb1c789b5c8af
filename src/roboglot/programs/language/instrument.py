"""Rewrites a checked syntax tree so that the running program reports its line and keeps to the language.

Each statement gets ``cell[0] = mark`` before it: one store into a list, the cheapest operation in CPython. In the tree,
both are constants that cannot be guessed; after compilation ``Marks.bind`` replaces them by the worker's own objects,
so that no name of the program leads to them. Knows nothing about the memory that the worker shares with the host.
"""

from __future__ import annotations

import ast
import os
from collections.abc import Callable
from types import CodeType
from typing import Protocol

METHODS = {"format": "$format", "has_key": "$has_key"}
"""Attributes read through a function of the worker, as text formatting reaches attributes by text.

``has_key`` exists for dictionaries here.
"""

# Statements that take no time and cannot fail, so programs never wait in them.
_INSTANT = (ast.Break, ast.Continue, ast.Global, ast.Nonlocal)
_BLOCKS = ("body", "orelse", "finalbody")


class Cell(Protocol):
    """A list of one item, or an object with the same item assignment."""

    def __setitem__(self, item: int, mark: object, /) -> None: ...


class Marks:
    """The placeholders of one run's code, and their objects.

    ``cell``: the list whose item 0 is the mark of the current place; ``mark(unit, line)``: returns a place's mark.
    """

    __slots__ = ("_cell", "_mark", "_nonce")

    def __init__(self, cell: Cell, mark: Callable[[int, int], object]) -> None:
        self._cell = cell
        self._mark = mark
        self._nonce = os.urandom(16)

    def statement(self, unit: int, line: int, at: ast.stmt) -> ast.stmt:
        """Return the statement ``cell[0] = mark`` at the position of ``at``."""
        target = ast.Subscript(ast.Constant(self._nonce), ast.Constant(0), ast.Store())
        mark = ast.Constant(self._nonce + unit.to_bytes(4, "big") + line.to_bytes(4, "big"))
        statement = ast.copy_location(ast.Assign([target], mark), at)
        statement.end_lineno = at.lineno
        return statement

    def bind(self, code: CodeType) -> CodeType:
        """Return the code with the real objects in place of the placeholders."""
        return code.replace(co_consts=tuple(map(self._bound, code.co_consts)))

    def _bound(self, constant: object) -> object:
        if isinstance(constant, CodeType):
            return self.bind(constant)
        if not isinstance(constant, bytes) or not constant.startswith(self._nonce):
            return constant
        place = constant[len(self._nonce) :]
        return self._mark(int.from_bytes(place[:4], "big"), int.from_bytes(place[4:], "big")) if place else self._cell


def instrument(tree: ast.Module, unit: int, marks: Marks, *, rewrite: bool = True) -> ast.Module:
    """Return the tree with line marks and, with ``rewrite``, the attributes of ``METHODS`` read through the worker."""
    if rewrite:
        tree = _Methods().visit(tree)
    marker = _Marker(unit, marks)
    tree.body = marker.marked(tree.body, 0, keep_first=_begins_with_text(tree.body))
    return ast.fix_missing_locations(tree)


class _Marker:
    """Puts marks into blocks. ``loop``: line of the enclosing loop if its condition makes calls, otherwise 0. Such a
    condition runs again after the body's last line or a ``continue``, so the loop's line is marked there.
    """

    def __init__(self, unit: int, marks: Marks) -> None:
        self._unit = unit
        self._marks = marks

    def marked(self, block: list[ast.stmt], loop: int, *, keep_first: bool = False) -> list[ast.stmt]:
        """Return the block with a mark before each statement, except for a docstring (``keep_first``)."""
        result: list[ast.stmt] = []
        for index, statement in enumerate(block):
            if isinstance(statement, ast.Continue) and loop:
                result.append(self._marks.statement(self._unit, loop, statement))
            elif not (index == 0 and keep_first) and not isinstance(statement, _INSTANT):
                result.append(self._marks.statement(self._unit, statement.lineno, statement))
            self._enter(statement, loop)
            result.append(statement)
        return result

    def _enter(self, statement: ast.stmt, loop: int) -> None:
        match statement:
            case ast.While():
                own = statement.lineno if _calls(statement.test) else 0
                statement.body = self.marked(statement.body, own)
                if own:
                    statement.body.append(self._marks.statement(self._unit, own, statement))
                statement.orelse = self.marked(statement.orelse, loop)
            case ast.For() | ast.AsyncFor():
                statement.body = self.marked(statement.body, 0)
                statement.orelse = self.marked(statement.orelse, loop)
            case ast.FunctionDef() | ast.AsyncFunctionDef() | ast.ClassDef():
                statement.body = self.marked(statement.body, 0, keep_first=_begins_with_text(statement.body))
            case _:
                for node in (statement, *getattr(statement, "handlers", ()), *getattr(statement, "cases", ())):
                    for field in _BLOCKS:
                        if block := getattr(node, field, None):
                            setattr(node, field, self.marked(block, loop))


def _begins_with_text(block: list[ast.stmt]) -> bool:
    match block:
        case [ast.Expr(value=ast.Constant(value=str())), *_]:
            return True
    return False


def _calls(test: ast.expr) -> bool:
    return any(isinstance(node, (ast.Call, ast.Attribute)) for node in ast.walk(test))


class _Methods(ast.NodeTransformer):
    """Turns ``x.format`` into the call ``$format(x)``, so that a program never holds a text's own method."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        function = METHODS.get(node.attr)
        if function is None or not isinstance(node.ctx, ast.Load):
            return node
        return ast.copy_location(ast.Call(ast.Name(function, ast.Load()), [node.value], []), node)
