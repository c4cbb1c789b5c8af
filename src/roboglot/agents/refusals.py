"""Sentences for arguments that do not fit a tool, in the words of the doors. Knows no tool and no robot."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING

from roboglot.spelling import WORD_MAX, meant
from roboglot.validation import KINDS

if TYPE_CHECKING:
    from pydantic import ValidationError
    from pydantic_core import ErrorDetails

REASONS_MAX = 8  # named in one refusal
_FORMS = {  # by the library's type of error; names in braces are those of its context
    "missing": "{place} is missing",
    "less_than_equal": "{place} must be at most {le}",
    "less_than": "{place} must be below {lt}",
    "greater_than_equal": "{place} must be at least {ge}",
    "greater_than": "{place} must be above {gt}",
    "too_long": "{place} must have at most {max_length} entries",
    "too_short": "{place} must have at least {min_length} entries",
    "string_too_long": "{place} must have at most {max_length} characters",
    "string_too_short": "{place} must have at least {min_length} characters",
    "string_pattern_mismatch": "{place} must match {pattern}",
    "string_unicode": "{place} must be text of whole characters",
    "finite_number": "{place} must be a finite number",
    "union_tag_not_found": "{place}.do is missing",
    "union_tag_invalid": "{place}.do cannot be {tag!r}; use {expected_tags}",
}
_WANTED = {"float": "float", "int": "int", "string": "str", "bool": "bool", "list": "array", "model": "object"}
_GOT: dict[type, str] = {
    bool: KINDS["bool"], int: KINDS["int"], float: KINDS["float"], str: KINDS["str"], list: KINDS["array"],
    dict: KINDS["object"], type(None): "null",
}  # fmt: skip


def why_refused(error: ValidationError, arguments: Mapping[str, object], schema: Mapping[str, object]) -> str:
    """Return in one sentence what is wrong with ``arguments``, and what was meant. ``schema``: the tool's, in JSON."""
    found = error.errors(include_url=False)
    reasons = [_reason(one, arguments, schema) for one in found[:REASONS_MAX]]
    more = [f"{len(found) - REASONS_MAX} more"] if len(found) > REASONS_MAX else []
    return "; ".join([*reasons, *more])


def _reason(one: ErrorDetails, arguments: object, schema: Mapping[str, object]) -> str:
    kind, place = one["type"], _place(one["loc"], arguments)
    if kind == "extra_forbidden":
        name = str(one["loc"][-1])
        known = sorted(_names(schema, one["loc"]))
        listed = f"; there are {', '.join(known)}" if known else ""
        return f"{place} is unknown{meant(name, known) or listed}"
    if form := _FORMS.get(kind):
        return form.format(place=place, **_in_words(one.get("ctx", {})))
    if wanted := _WANTED.get(kind.partition("_")[0]):
        return f"{place} must be {KINDS[wanted]}, not {_GOT.get(type(one['input']), 'that')}"
    return f"{place}: {one['msg']}"


def _in_words(context: Mapping[str, object]) -> dict[str, object]:
    """Return the values of a form: whole numbers without a fraction, words without quotes and bounded."""
    words = {name: f"{value:g}" if isinstance(value, float) else value for name, value in context.items()}
    if "expected_tags" in words:
        words["expected_tags"] = str(words["expected_tags"]).replace("'", "").replace(", ", " or ")
    return words | {"tag": str(words.get("tag", ""))[:WORD_MAX]}


def _place(path: Sequence[int | str], arguments: object) -> str:
    """Return the path of a value as its sender wrote it: ``plan[0].x``, without the kind that the library puts in."""
    written = ""
    for index, step in enumerate(path):
        if isinstance(step, int):
            written += f"[{step}]"
            arguments = arguments[step] if isinstance(arguments, list) and step < len(arguments) else None
        elif index == len(path) - 1 or (isinstance(arguments, dict) and step in arguments):
            written += f".{step[:WORD_MAX]}"
            arguments = arguments.get(step) if isinstance(arguments, dict) else None
    return written.removeprefix(".")


def _names(schema: Mapping[str, object], path: Sequence[int | str]) -> Iterable[str]:
    """Return the names that may stand beside the last of a path: the tool's arguments, or a step's fields."""
    if len(path) == 1:
        return _properties(schema)
    inner = schema.get("$defs")
    kinds = [kind for kind in inner.values() if isinstance(kind, dict)] if isinstance(inner, dict) else []
    return {name for kind in kinds if _is_step(kind, path[-2]) for name in _properties(kind)}


def _is_step(schema: Mapping[str, object], kind: int | str) -> bool:
    """Return True for the schema of that kind of step."""
    properties = schema.get("properties")
    do = properties.get("do") if isinstance(properties, dict) else None
    return isinstance(do, dict) and do.get("const") == kind


def _properties(schema: Mapping[str, object]) -> set[str]:
    properties = schema.get("properties")
    return {str(name) for name in properties} if isinstance(properties, dict) else set()
