"""Each code is requested over TLS, and each push read from an app's server."""

from __future__ import annotations

import ast
from pathlib import Path

from roboglot.protocols.cyberdog import server  # noqa: F401 - fills the tables
from roboglot.protocols.cyberdog.table import TABLE, extras, files, pushes
from roboglot.wire.contracts import contract

SWEEPS = ("examples", "every_code", "fuzz", "hostile")  # they call every code and ignore effects
ASKS = frozenset({"ask", "raw", "open", "answered", "Stream", "file", "fetch"})  # what calls over the TLS channel
READS = frozenset({"of"})  # what was pushed to the app


def numbers(names: frozenset[str]) -> set[int]:
    """Whole numbers that the tests of this folder hand to functions of these names."""
    found: set[int] = set()
    for path in Path(__file__).parent.rglob("test_*.py"):
        if path.stem.removeprefix("test_cyberdog_") in SWEEPS:
            continue
        for function in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(function, ast.Call) and _name(function.func) in names:
                found |= {number for node in function.args if (number := _number(node)) is not None}
    return found


def _name(function: ast.expr) -> str:
    match function:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ""


def _number(node: ast.expr) -> int | None:
    match node:
        case ast.Constant(value=int(number)) if not isinstance(number, bool):
            return number
    return None


def test_every_request_is_sent_and_every_push_read() -> None:
    requests = {int(operation.key) for operation in TABLE} | {int(code) for code in files}
    assert {int(row.key) for row in contract("cyberdog")} <= requests | set(pushes)
    assert {code for code, there in extras().items() if there} <= requests | set(pushes)
    assert requests - numbers(ASKS) == set()
    assert set(pushes) - numbers(READS) == set()
