"""Reads the sources for the sentences that pages may show: why something was refused, why it ended, what is wrong."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path

import roboglot
from roboglot.protocols import sections
from tests.statements import parsed, statements

ROOT = Path(roboglot.__file__).parent
CONFIGS = tuple(f"protocols/{name}/config.py" for name in sections())
PLACES = (
    "access/", "autonomy/", "config.py", "console/", "drivers/", "media/", "model/", "operations.py",
    "programs/", "protocols/visual/", "recording/", "rehearsal.py", "runtime.py", "shards/", "simulation/", "storage/",
    "task_conditions.py", "transport/", "wire/visual/", *CONFIGS,
)  # fmt: skip
KINDS = {"RobotError", "ProgramError", "BadParameters", "BadCondition", "Problem"}
# Pages show their ValueError and RuntimeError, too.
OUTSIDE = ("config.py", "console/", "model/", "rehearsal.py", "runtime.py", "simulation/", *CONFIGS)
TAILS = "spelling.py"  # what it returns is added to sentences
NAMED = {"cause", "why", "reason", "words", "wrong"}  # variables and arguments that hold such a sentence
# Position of the argument, where not the first.
LATER = {"set": 4, "_Watch": 4, "refuse": 1, "Problem": 1, "write": 1, "state": 1, "_answer": 1}
HOLE = "{}"


@cache
def sentences(root: Path = ROOT) -> dict[str, str]:
    """Return each sentence, with ``{}`` for what is filled in, and the first place where it is said."""
    names = {path.relative_to(root).as_posix(): path for path in sorted(root.rglob("*.py"))}
    trees = {name: parsed(path) for name, path in names.items() if name == TAILS or name.startswith(PLACES)}
    errors = _errors(trees)
    found: dict[str, str] = {}
    for name, tree in trees.items():
        said = _returned(tree) if name == TAILS else _said(tree, errors, name.startswith(OUTSIDE))
        for text, line in said:
            if re.search("[a-z]{2}", text.replace(HOLE, "")):
                found.setdefault(text.strip(), f"{name}:{line}")
    return found


def _errors(trees: Mapping[str, ast.Module]) -> set[str]:
    """Return the names of the classes below ``KINDS``."""
    bases: dict[str, set[str]] = {}
    for tree in trees.values():
        for node in statements(tree):
            if isinstance(node, ast.ClassDef):
                bases.setdefault(node.name, set()).update(map(_name, node.bases))
    known = set(KINDS)
    while new := {name for name, above in bases.items() if above & known} - known:
        known |= new
    return known


def _name(node: ast.expr) -> str:
    """Return the last word of what is called or derived from."""
    match node:
        case ast.Name(id=name) | ast.Attribute(attr=name):
            return name
    return ast.unparse(node).rpartition(".")[2]


def _returned(tree: ast.Module) -> Iterator[tuple[str, int]]:
    for node in ast.walk(tree):
        if isinstance(node, ast.Return) and node.value is not None:
            yield from ((text, node.lineno) for text in _texts(node.value))


def _said(tree: ast.Module, errors: set[str], outside: bool) -> Iterator[tuple[str, int]]:
    first = errors | {"cancel", "Failed", "__init__"} | ({"ValueError", "RuntimeError"} if outside else set())
    for node in ast.walk(tree):
        values: list[ast.expr] = []
        line = getattr(node, "lineno", 0)
        match node:
            case ast.Call():
                name = _name(node.func)
                place = LATER.get(name, 0 if name in first else len(node.args))
                values = node.args[place : place + 1]
                values += [keyword.value for keyword in node.keywords if keyword.arg in NAMED]
            case (
                ast.Assign(targets=[ast.Name(id=name) | ast.Attribute(attr=name)])
                | ast.AugAssign(target=ast.Name(id=name))
            ) if name in NAMED:
                values = [node.value]
            case ast.ClassDef(name="Failure", body=body):  # of orders
                values = [member.value for member in body if isinstance(member, ast.Assign)]
        for value in values:
            yield from ((text, line) for text in _texts(value))


def _texts(node: ast.expr) -> list[str]:
    """Return the possible values of an expression, as far as they are written down."""
    match node:
        case ast.Constant(value=str(text)):
            return [text]
        case ast.JoinedStr(values=parts):
            return ["".join(str(part.value) if isinstance(part, ast.Constant) else HOLE for part in parts)]
        case ast.IfExp(body=one, orelse=other):
            return _texts(one) + _texts(other)
        case ast.BoolOp(values=choices):
            return [text for choice in choices for text in _texts(choice)]
        case ast.BinOp(left=left, right=right, op=ast.Add()):
            return [one + other for one in _texts(left) or [HOLE] for other in _texts(right) or [HOLE]]
        case ast.Tuple(elts=[last, *rest]):
            return [text for choice in [last, *rest] for text in _texts(choice)]
    return []
