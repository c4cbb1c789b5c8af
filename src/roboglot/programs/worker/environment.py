"""The built-in names of a program: Python's, without those that leave the language, and the robot's additions.

Knows the language's rules about attributes; knows no robot.
"""

from __future__ import annotations

import builtins
import string
import sys
from collections.abc import Callable, Mapping, Sequence
from types import BuiltinMethodType, ModuleType
from typing import Any

from roboglot.programs.language.instrument import METHODS
from roboglot.programs.language.names import BUILTINS
from roboglot.programs.language.policy import attribute_allowed

# CPython itself imports these inside int(), str() and strptime(), using the program's __import__;
# the checker refuses them in a program's text.
_INTERNAL = frozenset({"_pylong", "_strptime"})


class RobotError(Exception):
    """Refusal or failure of the robot; base class of all error types that the host names."""


def build_builtins(write: Callable[[str], None], modules: Mapping[str, ModuleType]) -> dict[str, object]:
    """Return the ``__builtins__`` of one run."""
    own: dict[str, object] = {
        "print": _printer(write),
        "getattr": _getattr,
        "hasattr": _hasattr,
        "setattr": _setattr,
        "delattr": _delattr,
        "type": _type,
        "exit": _exit,
        "quit": _exit,
        "true": True,
        "false": False,
        "RobotError": RobotError,
    }
    offered = {name: own[name] if name in own else getattr(builtins, name) for name in BUILTINS}

    def import_module(
        name: str, globals: object = None, locals: object = None, fromlist: Sequence[str] = (), level: int = 0
    ) -> ModuleType:
        if name in _INTERNAL and name in sys.modules:
            return sys.modules[name]
        if level or name not in modules:
            raise ImportError(f"'{name}' cannot be imported in robot programs")
        return modules[name]

    return {
        **offered,
        "__import__": import_module,
        "__build_class__": builtins.__build_class__,
        "__name__": "builtins",
        METHODS["format"]: _format_of,
        METHODS["has_key"]: _has_key_of,
    }


def _printer(write: Callable[[str], None]) -> Callable[..., None]:
    def print(
        *values: object, sep: str | None = " ", end: str | None = "\n", file: None = None, flush: bool = False
    ) -> None:
        if file is not None:
            raise TypeError("print() has no files here")
        for name, text in (("sep", sep), ("end", end)):
            if text is not None and not isinstance(text, str):
                raise TypeError(f"{name} must be None or a string, not {type(text).__name__}")
        write((" " if sep is None else sep).join(map(str, values)) + ("\n" if end is None else end))

    return print


def _exit(code: object = None) -> None:
    raise SystemExit(code)


def _checked(name: object) -> str:
    if not isinstance(name, str):
        raise TypeError("attribute name must be string")
    plain = str.__str__(name)  # a subclass could return different text each time
    if not attribute_allowed(plain):
        raise AttributeError(f"'.{plain}' cannot be used in robot programs")
    return plain


def _getattr(value: object, name: str, *default: object) -> object:
    plain = _checked(name)
    if plain in METHODS:
        return (_format_of if plain == "format" else _has_key_of)(value)
    return getattr(value, plain, *default)


def _hasattr(value: object, name: str) -> bool:
    try:
        _getattr(value, name)
    except AttributeError:
        return False
    return True


def _setattr(value: object, name: str, new: object) -> None:
    setattr(value, _checked(name), new)


def _delattr(value: object, name: str) -> None:
    delattr(value, _checked(name))


def _type(value: object, *more: object) -> object:
    """Return the type of a value, but no metaclass: with one, ``case`` patterns could read any attribute."""
    if more:
        raise TypeError("type() takes 1 argument in robot programs")
    kind = type(value)
    if issubclass(kind, type):
        raise TypeError("type() of a class is not available in robot programs")
    return kind


class _Formatter(string.Formatter):
    """``str.format`` with fields limited by the language's rules about attributes."""

    def get_field(self, field_name: str, args: Sequence[object], kwargs: Mapping[str, object]) -> object:
        for part in field_name.replace("[", ".[").split(".")[1:]:
            if not part.startswith("["):
                _checked(part)
        return super().get_field(field_name, args, kwargs)


_formatter = _Formatter()


def _format_of(value: Any) -> Any:
    """Return ``value.format`` of any value (text, a type, ``super()`` ...), with a safe version of text's own."""
    method = value.format
    if method is str.format:
        return lambda text, *args, **kwargs: _formatter.vformat(text, args, kwargs)
    if isinstance(method, BuiltinMethodType) and isinstance(method.__self__, str):
        text = method.__self__
        return lambda *args, **kwargs: _formatter.vformat(text, args, kwargs)
    return method


def _has_key_of(value: Any) -> Any:
    """Return ``value.has_key``; the vendor's programs use it on dictionaries."""
    return value.__contains__ if isinstance(value, dict) else value.has_key
