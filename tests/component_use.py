"""Components of the model that a handler's source asks its robot for: ``robot[Base]``, ``robot.require(Base)``.

Follows the functions of the handler's door, and methods and properties whose name only one class there has.
``X in robot`` makes X optional, for then the handler knows what to do without.
"""

from __future__ import annotations

import ast
import importlib
import inspect
import pkgutil
import sys
import textwrap
from collections.abc import Callable, Iterator
from functools import cache
from types import FunctionType, ModuleType
from typing import Any, get_type_hints

from roboglot.model.components.component import Component

DEPTH_MAX = 12
SHARED = "roboglot.protocols.ros_commands"  # by doors


def used_by(handler: Callable[..., Any]) -> frozenset[type[Component]]:
    """Return the components without which ``handler`` cannot do its work."""
    required: set[type[Component]] = set()
    optional: set[type[Component]] = set()
    itself: set[type[Component]] = set()  # taken in the handler's own source, even if others ask first
    seen: set[FunctionType] = set()
    waiting: list[tuple[Any, int]] = [(handler, 0)]
    while waiting:
        function, depth = waiting.pop()
        function = inspect.unwrap(function)
        if not isinstance(function, FunctionType) or function in seen or depth > DEPTH_MAX:
            continue
        seen.add(function)
        for node in _nodes(function):
            required |= {*_subscripts(node, function), *_requirements(node, function)}
            optional |= set(_questions(node, function))
            waiting += [(called, depth + 1) for called in _calls(node, function)]
        if depth == 0:
            itself = required - optional
    return frozenset(required - optional | itself)


@cache
def _nodes(function: FunctionType) -> list[ast.AST]:
    return list(ast.walk(ast.parse(textwrap.dedent(inspect.getsource(function)))))


def _subscripts(node: ast.AST, function: FunctionType) -> Iterator[type[Component]]:
    if isinstance(node, ast.Subscript) and isinstance(node.slice, ast.Name):
        yield from _component(node.slice.id, function)


def _requirements(node: ast.AST, function: FunctionType) -> Iterator[type[Component]]:
    match node:
        case ast.Call(func=ast.Attribute(attr="require"), args=args):
            for arg in args:
                if isinstance(arg, ast.Name):
                    yield from _component(arg.id, function)


def _questions(node: ast.AST, function: FunctionType) -> Iterator[type[Component]]:
    match node:
        case ast.Compare(left=ast.Name(id=name)):  # component types are only compared with a robot's own
            yield from _component(name, function)


def _component(name: str, function: FunctionType) -> Iterator[type[Component]]:
    found = function.__globals__.get(name)
    if isinstance(found, type) and issubclass(found, Component) and found is not Component:
        yield found


def _calls(node: ast.AST, function: FunctionType) -> Iterator[Any]:
    """Yield functions of the same package, or shared by doors, that are called, or handed on to be called."""
    names, package = function.__globals__, _package_of(function)
    found: Any = None
    match node:
        case ast.Name(id=name):
            found = names.get(name)
        case ast.Attribute(value=ast.Name(id=name), attr=attribute) if isinstance(names.get(name), ModuleType):
            found = getattr(names[name], attribute, None)
        case ast.Attribute(value=value, attr=attribute) if not _is_of_component(value, function):
            found = _methods(package).get(attribute)
            if isinstance(found, property):  # many classes have a "pose": only those known to be of that class count
                found = found.fget if _is_of_package(value, function, package) else None
    if isinstance(found, FunctionType) and found.__module__.startswith((package, SHARED)):
        yield found


def _package_of(function: FunctionType) -> str:
    """Return the door's or the programs' package: its chapters may have packages of their own."""
    return ".".join(function.__module__.split(".")[:3])


def _is_of_component(value: ast.expr, function: FunctionType) -> bool:
    """True if ``value`` comes from a component, such as ``robot[Odometry].reading``."""
    while True:
        match value:
            case ast.Attribute(value=inner) | ast.Call(func=inner):
                value = inner
            case ast.Subscript(slice=ast.Name(id=name)):
                return any(_component(name, function))
            case _:
                return False


def _is_of_package(value: ast.expr, function: FunctionType, package: str) -> bool:
    """True if ``value`` is ``self``, or a part of a parameter whose class takes it from the package."""
    match value:
        case ast.Name(id="self"):
            return True
        case ast.Attribute(value=ast.Name(id=name), attr=part):
            owner = get_type_hints(function).get(name)
            kind = get_type_hints(owner).get(part) if isinstance(owner, type) else None
            return isinstance(kind, type) and kind.__module__.startswith(package)
    return False


@cache
def _methods(package: str) -> dict[str, FunctionType | property]:
    """Return methods and properties of the package's classes by name, if only one class has the name."""
    for module in pkgutil.walk_packages(getattr(sys.modules[package], "__path__", ()), f"{package}."):
        importlib.import_module(module.name)
    classes = {
        value
        for name, module in tuple(sys.modules.items())
        if name.startswith(f"{package}.")
        for value in vars(module).values()
        if isinstance(value, type) and value.__module__.startswith(package)
    }
    found: dict[str, list[FunctionType | property]] = {}
    for cls in classes:
        for name, member in vars(cls).items():
            if isinstance(member, FunctionType | property) and not name.startswith("__"):
                found.setdefault(name, []).append(member)
    return {name: members[0] for name, members in found.items() if len(members) == 1}
