"""The nearest valid command to a refused one, for the log and for teaching tools."""

from __future__ import annotations

import difflib
import types
import typing
from collections.abc import Mapping
from enum import StrEnum
from typing import Annotated, Any, Literal, get_args, get_origin

from msgspec import Meta

from roboglot.operations import BadParameters
from roboglot.protocols.robomaster.shapes import Shape
from roboglot.spelling import meant, nearest
from roboglot.wire.robomaster.commands import QUERY, Command, Value

EXCLUSIVE_STEP = 0.1  # distance of a suggested number from an excluded bound


def nearest_command(command: Command, keys: typing.Collection[str]) -> str:
    """Return the most similar known command with the given words, or ""."""
    wanted = " ".join((*command.words[:2], *((QUERY,) if command.query else ())))
    alike = {key for key in keys if key.endswith(QUERY) == command.query}
    near = nearest(wanted, alike) or nearest(wanted, keys)  # perhaps only the question mark is wrong
    return f"did you mean `{_spelt(near, command.words[2:])}`?" if near else ""


def _spelt(key: str, words: typing.Iterable[str]) -> str:
    """Return the command's text: the mark of a query comes last."""
    name = key.removesuffix(f" {QUERY}")
    return " ".join((name, *words, *((QUERY,) if name != key else ())))


def nearest_values(name: str, shape: Shape, values: Mapping[str, Value]) -> str:
    """Return the wrong values, their valid ranges, and the command with the nearest valid values."""
    wrong: list[str] = []
    better = dict(values)
    for parameter, value in values.items():
        try:
            shape.check(_only(shape, parameter, value))
        except BadParameters:
            kind = _bare(shape.kinds[parameter])
            wrong.append(f"{parameter} is {_worded(kind)}")
            nearest = _nearest(kind, value)
            if nearest is None:
                return "; ".join(wrong)
            better[parameter] = nearest
    if not wrong:
        return ""
    words = [str(v) if key in shape.bare else f"{key} {v}" for key, v in better.items()]
    return f"{'; '.join(wrong)}; did you mean `{_spelt(name, words)}`?"


def without_effect(shape: Shape, ignored: typing.Sequence[str]) -> str:
    """Return a warning that the ``ignored`` words have no effect, with the parameter that was probably meant."""
    hint = next((near for word in ignored if (near := meant(word, shape.kinds))), "")
    return f"{' '.join(ignored)} {'has' if len(ignored) == 1 else 'have'} no effect{hint}"


def completed(name: str, shape: Shape, values: Mapping[str, Value]) -> str:
    """Return the command completed by valid values: all required ones, or else the first optional one."""
    lacking = [parameter for parameter in shape.required if parameter not in values] or list(shape.kinds)[:1]
    fillers = {parameter: _nearest(_bare(shape.kinds[parameter]), "") for parameter in lacking}
    words = [str(v) if key in shape.bare else f"{key} {v}" for key, v in {**values, **fillers}.items()]
    return f"did you mean `{_spelt(name, words)}`?"


def _only(shape: Shape, parameter: str, value: Value) -> dict[str, Value | None]:
    """Return this value together with valid values for other required parameters."""
    fillers = {name: _nearest(_bare(shape.kinds[name]), "") for name in shape.required}
    return fillers | {parameter: value}


def _bare(kind: object) -> object:
    """Return ``kind`` without its ``| None``."""
    if get_origin(kind) in (types.UnionType, typing.Union):
        return next(part for part in get_args(kind) if part is not type(None))
    return kind


def _choices(kind: Any) -> tuple[Any, ...]:
    if get_origin(kind) is Annotated:
        return _choices(kind.__origin__)
    if get_origin(kind) is Literal:
        return tuple(choice for choice in get_args(kind) if choice != "")
    if isinstance(kind, type) and issubclass(kind, StrEnum):
        return tuple(str(choice) for choice in kind)
    return (True, False) if kind is bool else ()


def _limits(kind: object) -> Meta | None:
    return next((extra for extra in getattr(kind, "__metadata__", ()) if isinstance(extra, Meta)), None)


def _worded(kind: Any) -> str:
    if choices := _choices(kind):
        return " or ".join(str(choice).lower() if isinstance(choice, bool) else str(choice) for choice in choices)
    limits = _limits(kind)
    if limits is None:
        return "a word" if kind is str else "a number"
    whole = "a whole number " if kind.__origin__ is int else ""
    above = f"above {limits.gt:g}" if limits.gt is not None else f"{limits.ge:g}"
    return f"{whole}{above} to {limits.le:g}"


def _nearest(kind: Any, value: Value) -> Value | None:
    """Return the valid value nearest to ``value``; None if unknown."""
    if choices := _choices(kind):
        if isinstance(value, int | float) and all(isinstance(choice, int) for choice in choices):
            nearest: int = min(choices, key=lambda choice: abs(choice - value))
            return nearest
        texts = [str(choice).lower() if isinstance(choice, bool) else str(choice) for choice in choices]
        return (difflib.get_close_matches(str(value).lower(), texts, n=1, cutoff=0.3) or texts)[0]
    limits = _limits(kind)
    if limits is None:
        return "all" if kind is str else None  # the only free-form word is the choice of lamps
    low = limits.ge if limits.ge is not None else (limits.gt or 0) + EXCLUSIVE_STEP
    high = limits.le if limits.le is not None else low
    number = value if isinstance(value, int | float) and not isinstance(value, bool) else max(low, min(high, 1))
    number = max(low, min(high, number))
    return round(number) if kind.__origin__ is int or float(number).is_integer() else number
