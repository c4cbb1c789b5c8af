"""Statements of source files, for tests that read them: a tenth of the nodes that ``ast.walk`` visits."""

from __future__ import annotations

import ast
import gc
from functools import cache
from pathlib import Path

BLOCKS = ("body", "orelse", "finalbody", "handlers", "cases")


@cache
def parsed(path: Path) -> ast.Module:
    """Return a file's syntax tree, parsed once for all tests of a worker.

    Without looking for garbage, of which there is none among thousands of new nodes. Nor is there later: they refer to
    each other in one direction only.
    """
    looked_for = gc.isenabled()
    gc.disable()
    try:
        return ast.parse(path.read_text("utf-8"))
    finally:
        gc.freeze()
        if looked_for:
            gc.enable()


def statements(tree: ast.Module) -> list[ast.AST]:
    """Return the module and all statements in it: all that defines or imports something; handlers and cases, too."""
    found: list[ast.AST] = [tree]
    for node in found:  # grows meanwhile
        for block in BLOCKS:
            inner = getattr(node, block, ())
            found += inner if isinstance(inner, list) else ()  # a lambda's body is one expression
    return found
