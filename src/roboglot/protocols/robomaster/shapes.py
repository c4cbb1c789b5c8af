"""Conversion of each command's words into checked parameters, read from its handler's signature once.

A parameter before the ``*`` takes a bare word or its name; those after it must be named. ``OnRobots`` annotations give
a command a second set of ranges for the profiles of robots' builds.
"""

from __future__ import annotations

import inspect
import types
import typing
from collections.abc import Mapping, Sequence
from functools import cache
from typing import Annotated, Any, get_args, get_origin

import msgspec

from roboglot.operations import BadParameters, Operation
from roboglot.protocols.robomaster.ranges import OnRobots
from roboglot.validation import why_invalid
from roboglot.values import dataclass
from roboglot.wire.robomaster.commands import Value, ignored_words, parameters_of

Kinds = dict[str, object]  # parameter name: annotation


@dataclass(frozen=True, slots=True)
class Shape:
    """Parameters of one command under one profile."""

    kinds: Kinds
    bare: tuple[str, ...]
    required: tuple[str, ...]
    struct: type[msgspec.Struct]

    def values(self, words: Sequence[str]) -> dict[str, Value]:
        """Return the words by parameter, unchecked."""
        return parameters_of(words, tuple(self.kinds), self.bare)

    def ignored(self, words: Sequence[str]) -> tuple[str, ...]:
        """Return the words that have no effect."""
        return ignored_words(words, tuple(self.kinds), self.bare)

    def check(self, values: Mapping[str, Value | None]) -> dict[str, object]:
        """Return the converted and checked values of all parameters. Raises BadParameters naming the parameter."""
        if not self.kinds:
            return {}
        try:
            checked = msgspec.convert(values, self.struct, strict=False)
        except msgspec.ValidationError as error:
            raise BadParameters(why_invalid(error, wanted=self.struct)) from None
        return {name: getattr(checked, name) for name in self.kinds}


@cache
def shape_of(operation: Operation[str], as_robots: bool) -> Shape:
    """Return the shape of ``operation`` with the manual's ranges, or those of robots."""
    _, *parameters = inspect.signature(operation.handler, eval_str=True).parameters.values()
    kinds: Kinds = {p.name: _as_robots(p.annotation) if as_robots else p.annotation for p in parameters}
    fields: list[tuple[str, object] | tuple[str, object, object]] = [
        (p.name, kinds[p.name]) if p.default is p.empty else (p.name, kinds[p.name], p.default) for p in parameters
    ]
    return Shape(
        kinds,
        tuple(p.name for p in parameters if p.kind is p.POSITIONAL_OR_KEYWORD),
        tuple(p.name for p in parameters if p.default is p.empty),
        msgspec.defstruct(operation.handler.__qualname__, fields, kw_only=True),
    )


def _as_robots(kind: Any) -> Any:
    """Return ``kind`` with the types of robots in place of those annotated with ``OnRobots``."""
    if get_origin(kind) is Annotated:
        return next((extra.kind for extra in kind.__metadata__ if isinstance(extra, OnRobots)), kind)
    if get_origin(kind) in (types.UnionType, typing.Union):
        return typing.Union[tuple(_as_robots(part) for part in get_args(kind))]  # noqa: UP007 - made at run time
    return kind
