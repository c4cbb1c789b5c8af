"""Rewrites a checked syntax tree so that the running program tells its line and keeps to the language.

Before each statement it inserts ``$line.value = place``: the host shares that memory. The names it uses cannot be typed
in a program, so nothing can collide with or reach them by name. Knows nothing of how the worker provides them.
"""

from __future__ import annotations

import ast

LINE = "$line"
"""An object whose ``value`` receives the place."""
MARK = "$mark"
"""A function ``mark(place)`` that stores the place and returns None."""
METHODS = {"format": "$format", "has_key": "$has_key"}
"""Attributes read through a function of the worker: text formatting reaches attributes by text.

Dictionaries know ``has_key`` here.
"""

LINE_BITS = 20
"""A place is ``unit << LINE_BITS | line``: 0 is the program, 1... its modules."""

# Statements that take no time and cannot fail: nobody sees a program wait there.
_INSTANT = (ast.Break, ast.Continue, ast.Global, ast.Nonlocal)
_BLOCKS = ("body", "orelse", "finalbody")


def place(unit: int, line: int) -> int:
    """The number stored for a line of a unit."""
    return unit << LINE_BITS | line


def unplace(number: int) -> tuple[int, int]:
    """The unit and the line of a stored number."""
    return number >> LINE_BITS, number & ((1 << LINE_BITS) - 1)


def instrument(tree: ast.Module, unit: int, *, rewrite: bool = True) -> ast.Module:
    """The tree with line marks, and (``rewrite``) with the methods of ``METHODS`` led through the worker."""
    if rewrite:
        tree = _Methods().visit(tree)
    for node in list(ast.walk(tree)):
        for field in _BLOCKS:
            block = getattr(node, field, None)
            if isinstance(block, list) and block and isinstance(block[0], ast.stmt):
                setattr(node, field, _marked(block, unit, keep_first=_has_docstring(node, field, block)))
        if isinstance(node, ast.While) and _calls(node.test):
            # The condition runs again after the last line of the body: without this its calls would be reported there.
            node.test = _mark_before(node.test, unit, node.lineno)
    return ast.fix_missing_locations(tree)


def _marked(block: list[ast.stmt], unit: int, *, keep_first: bool) -> list[ast.stmt]:
    marked: list[ast.stmt] = []
    for index, statement in enumerate(block):
        if not (index == 0 and keep_first) and not isinstance(statement, _INSTANT):
            target = ast.Attribute(ast.Name(LINE, ast.Load()), "value", ast.Store())
            marked.append(
                ast.copy_location(ast.Assign([target], ast.Constant(place(unit, statement.lineno))), statement)
            )
        marked.append(statement)
    return marked


def _has_docstring(node: ast.AST, field: str, block: list[ast.stmt]) -> bool:
    if field != "body" or not isinstance(node, (ast.Module, ast.FunctionDef, ast.ClassDef)):
        return False
    match block[0]:
        case ast.Expr(value=ast.Constant(value=str())):
            return True
    return False


def _calls(test: ast.expr) -> bool:
    return any(isinstance(node, (ast.Call, ast.Attribute)) for node in ast.walk(test))


def _mark_before(test: ast.expr, unit: int, line: int) -> ast.expr:
    mark = ast.Call(ast.Name(MARK, ast.Load()), [ast.Constant(place(unit, line))], [])
    return ast.copy_location(ast.BoolOp(ast.Or(), [mark, test]), test)


class _Methods(ast.NodeTransformer):
    """``x.format`` becomes ``$format(x)``: a call, so that a text's own method never gets loose."""

    def visit_Attribute(self, node: ast.Attribute) -> ast.expr:
        self.generic_visit(node)
        function = METHODS.get(node.attr)
        if function is None or not isinstance(node.ctx, ast.Load):
            return node
        return ast.copy_location(ast.Call(ast.Name(function, ast.Load()), [node.value], []), node)
