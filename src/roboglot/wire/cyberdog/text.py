"""The JSON inside the messages, parsed as leniently as real clients need. Knows no message by name."""

from __future__ import annotations

import json
from collections.abc import Mapping, Set
from functools import cache
from itertools import islice
from typing import Annotated, NoReturn

import msgspec

from roboglot.spelling import WORD_MAX, nearest
from roboglot.validation import why_invalid

# Used when the strict reader fails: raw line ends inside strings, as in one app's SDP.
_lenient = json.JSONDecoder(strict=False, parse_constant=lambda name: _refuse(name))

UNKNOWN_MAX = 16  # unknown names of a message that are described
NOTHING = "{}"  # usual params of requests without fields
Int32 = Annotated[int, msgspec.Meta(ge=-(2**31), le=2**31 - 1)]
Three = Annotated[list[float], msgspec.Meta(min_length=3, max_length=3)]
TwoOrThree = Annotated[list[float], msgspec.Meta(min_length=2, max_length=3)]


def code_of(operation: str) -> int | None:
    """Return the code in a recording's name of an operation; None if no message could carry it."""
    if not (operation.isascii() and operation.isdecimal() and len(operation) < 11):
        return None
    code = int(operation)
    return code if code < 2**31 else None


class NotJson(ValueError):
    """``params`` are not JSON."""


def read_params(text: str) -> Mapping[str, object]:
    """Return the fields of a request; none for JSON other than an object. Raises NotJson."""
    if text == NOTHING:
        return {}
    value = read_json(text)
    if not isinstance(value, dict):
        return {}
    # null stands for an absent field.
    return {name: field for name, field in value.items() if field is not None}


def read_json(text: str) -> object:
    """Return the value in ``text``, whose strings may have raw line ends. Raises NotJson."""
    try:
        value: object = msgspec.json.decode(text)
    except (ValueError, RecursionError) as error:
        if "\n" not in text and "\r" not in text:
            raise NotJson(str(error)) from None
        return _decode_with_line_ends(text)
    return value


def _decode_with_line_ends(text: str) -> object:
    """Return the value in ``text``, within the strict reader's bounds: no half characters, no infinite numbers."""
    try:
        value: object = msgspec.json.decode(json.dumps(_lenient.decode(text)))
        return value
    except (ValueError, RecursionError) as error:
        raise NotJson(str(error)) from None


def _refuse(name: str) -> NoReturn:
    raise ValueError(f"{name} is not JSON")


def fitting(values: Mapping[str, object], fields: type[msgspec.Struct]) -> Mapping[str, object]:
    """Return those of ``values`` with the type of their field; others count as missing, as on real robots."""
    return {
        field.name: values[field.name]
        for field in _fields(fields)
        if field.name in values and _fits(values[field.name], field.type)
    }


def mismatches(values: Mapping[str, object], fields: type[msgspec.Struct]) -> list[str]:
    """Describe the errors in those of ``values`` that ``fitting`` leaves out."""
    return [
        reason
        for field in _fields(fields)
        if field.name in values and (reason := _misfit(field.name, values[field.name], field.type))
    ]


def unknown_names(values: Mapping[str, object], fields: type[msgspec.Struct], unused: Set[str]) -> dict[str, str]:
    """Return the first names in ``values`` that are neither fields nor ``unused``: each with the field it means or "".

    A message can have hundreds of thousands, and each takes a search.
    """
    known = fields.__struct_fields__
    unknown = (name for name in values if name not in known and name not in unused)
    return {name: nearest(name, known) for name in islice(unknown, UNKNOWN_MAX)}


def why_unknown(name: str, near: str) -> str:
    """Return a sentence about an unknown name and the field that was meant, if there is one."""
    return f"{name[:WORD_MAX]} is unknown" + (f"; did you mean {near!r}?" if near else "")


@cache
def _fields(kind: type[msgspec.Struct]) -> tuple[msgspec.structs.FieldInfo, ...]:
    return msgspec.structs.fields(kind)  # slower than the rest of a request


def _fits(value: object, kind: object) -> bool:
    return not _misfit("", value, kind)


def _misfit(name: str, value: object, kind: object) -> str:
    """Return the reason why ``value`` of the field ``name`` is not of type ``kind``; empty if it is."""
    try:
        # Some languages write whole numbers in JSON with a decimal point: 303.0 counts as 303.
        msgspec.convert(value, kind, strict=not isinstance(value, float))
    except msgspec.ValidationError as error:
        return why_invalid(error, field=name, wanted=kind)
    return ""


def write(value: object) -> str:
    """Return the text of an answer or push: strings unchanged, other values as JSON."""
    return value if isinstance(value, str) else msgspec.json.encode(value).decode()
