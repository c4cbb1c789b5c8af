"""Which components of the model a handler asks its robot for, read from its source: ``robot[Base]`` and its like.

Follows the functions of the handler's own package, and methods and properties whose name only one class there has.
``X in robot`` makes X optional, for then the handler knows what to do without.
"""

from __future__ import annotations

import ast
import inspect
import sys
import textwrap
from collections.abc import Callable, Iterator
from functools import cache
from types import FunctionType, ModuleType
from typing import Any

from roboglot.model.components.component import Component

DEPTH_MAX = 12


def needs_of(handler: Callable[..., Any]) -> frozenset[type[Component]]:
    """The interfaces without which ``handler`` cannot do its work."""
    required: set[type[Component]] = set()
    optional: set[type[Component]] = set()
    seen: set[FunctionType] = set()
    waiting: list[tuple[Any, int]] = [(handler, 0)]
    while waiting:
        function, depth = waiting.pop()
        function = inspect.unwrap(function)
        if not isinstance(function, FunctionType) or function in seen or depth > DEPTH_MAX:
            continue
        seen.add(function)
        for node in ast.walk(_tree(function)):
            required |= set(_subscripts(node, function))
            optional |= set(_questions(node, function))
            waiting += [(called, depth + 1) for called in _calls(node, function)]
    return frozenset(required - optional)


def _tree(function: FunctionType) -> ast.AST:
    return ast.parse(textwrap.dedent(inspect.getsource(function)))


def _subscripts(node: ast.AST, function: FunctionType) -> Iterator[type[Component]]:
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name):
        yield from _component(node.slice.id, function)


def _questions(node: ast.AST, function: FunctionType) -> Iterator[type[Component]]:
    match node:
        case ast.Compare(left=ast.Name(id=name)):  # a component's type is compared with nothing but what a robot has
            yield from _component(name, function)


def _component(name: str, function: FunctionType) -> Iterator[type[Component]]:
    found = function.__globals__.get(name)
    if isinstance(found, type) and issubclass(found, Component) and found is not Component:
        yield found


def _calls(node: ast.AST, function: FunctionType) -> Iterator[Any]:
    """Functions of the same package that are called, or handed on to be called."""
    names, package = function.__globals__, function.__module__.rpartition(".")[0]
    found: Any = None
    match node:
        case ast.Name(id=name):
            found = names.get(name)
        case ast.Attribute(value=ast.Name(id=name), attr=attribute) if isinstance(names.get(name), ModuleType):
            found = getattr(names[name], attribute, None)
        case ast.Attribute(attr=attribute):
            found = _methods(package).get(attribute)
    if isinstance(found, FunctionType) and found.__module__.startswith(package):
        yield found


@cache
def _methods(package: str) -> dict[str, FunctionType]:
    """Methods and properties of the package's classes by name, those whose name is there once."""
    classes = {
        value
        for name, module in tuple(sys.modules.items())
        if name.startswith(f"{package}.")
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__.startswith(package)
    }
    found: dict[str, list[FunctionType]] = {}
    for cls in classes:
        for name, member in vars(cls).items():
            function = member.fget if isinstance(member, property) else member
            if isinstance(function, FunctionType) and not name.startswith("__"):
                found.setdefault(name, []).append(function)
    return {name: functions[0] for name, functions in found.items() if len(functions) == 1}
