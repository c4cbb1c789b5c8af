"""Sentences for invalid values: the field's path as its sender wrote it, and the expected value.

They replace the library's messages, with Python's types and paths that begin with ``$``, at every door, at the console
and in readers of files. Knows no protocol and no robot.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeVar

import msgspec
from msgspec import inspect

from roboglot.spelling import brief, meant

CHOICES_MAX = 30  # words or fields named in a sentence
SENTENCE_MAX = 500  # characters about what is wrong, which may quote its sender
PORT_MAX = 65535
T = TypeVar("T")

KINDS = {
    "float": "a number", "int": "a whole number", "str": "text", "bool": "true or false", "array": "a list",
    "object": "an object", "bytes": "base64 text",
}  # fmt: skip
PYTHON = {**KINDS, "bool": "True or False", "object": "a dictionary", "null": "None"}  # for programs
_PLACE = re.compile(r"(?s)(.*?)(?: - at `(key` in `)?\$\.?([^`]*)`)?")
_FORMS = {  # the library's messages; the first group of a missing or unknown field belongs to the path
    r"Object missing required field `(.+)`": "{place} is missing",
    r"Object contains unknown field `(.*)`": "{place} is unknown",
    r"Expected `(.+)`, got `(.+)`": "{place} must be {}, not {}",
    r"Expected `str`": "{place} must be text",  # a field's name
    r"Expected `array` of length (\d+), got (\d+)": "{place} must have {} entries, not {}",
    r"Expected `array` of at least length (\d+), got (\d+)": "{place} must have at least {} entries, not {}",
    r"Expected `str` of length <= (\d+)": "{place} must have at most {} characters",
    r"Expected `str` of length >= (\d+)": "{place} must have at least {} characters",
    r"Expected `\w+` of length <= (\d+)": "{place} must have at most {} entries",
    r"Expected `\w+` of length >= (\d+)": "{place} must have at least {} entries",
    r"Expected `\w+` <= (.+)": "{place} must be at most {}",
    r"Expected `\w+` >= (.+)": "{place} must be at least {}",
    r"Expected `\w+` < (.+)": "{place} must be below {}",
    r"Expected `\w+` > (.+)": "{place} must be above {}",
    r"Expected `\w+` that's a multiple of (.+)": "{place} must be a multiple of {}",
    r"Expected `str` matching regex '(.+)'": "{place} must match {}",
    r"Invalid (?:enum )?value (.+)": "{place} cannot be {}",
    r"(?:Number|Integer value) out of range": "a number is out of range",  # of a place that the library does not name
}
# Text that would be read as a number where text may be one, or has letters of these words or a minus escaped.
_NO_NUMBER = re.compile(rb'"-?(nan|inf|infinity)"|\\u00(2d|[46][169e]|[57][49])', re.IGNORECASE)
_MATCHERS = [(re.compile(pattern, re.DOTALL), form) for pattern, form in _FORMS.items()]
FORMS = frozenset(form.replace("{place}", "{}") for form in _FORMS.values())


def why_invalid(
    error: Exception,
    whole: str = "the value",
    *,
    field: str = "",
    kinds: Mapping[str, str] = KINDS,
    wanted: object = None,
) -> str:
    """Return in plain words why a value is invalid; the text of another error unchanged.

    ``field``: the field with the value, if it is not the whole; ``whole``: its name if no field is wrong.
    ``kinds``: the words for types. ``wanted``: the type that the value should have; with it, the sentence names the
    words and fields that are allowed, or guesses the one that was meant.
    """
    message = brief(_plain(error, whole, field, kinds), SENTENCE_MAX)
    if wanted is None or not isinstance(error, msgspec.ValidationError):
        return message
    return message + _remedy(str(error), wanted)


def _remedy(error: str, wanted: object) -> str:
    """Return what would be valid instead, as the end of a sentence; empty if that is not a matter of words."""
    found = _PLACE.fullmatch(error)
    _, key, path = found.groups() if found else ("", None, None)
    if unknown := re.search(r"unknown field `([^`]+)`", error):
        kinds = [kind for kind in _at(wanted, path) if isinstance(kind, inspect.StructType)]
        fields = list(dict.fromkeys(field.encode_name for kind in kinds for field in kind.fields))
        if near := meant(unknown[1], fields):
            return near
        if home := _home_of(unknown[1], wanted):
            return f"; it belongs in {home}"
        near = meant(unknown[1], _fields_of(wanted))
        return near or (f"; there are {', '.join(fields)}" if 0 < len(fields) <= CHOICES_MAX else "")
    if not error.startswith(("Invalid value", "Invalid enum value")):
        return ""
    words = list(dict.fromkeys(str(word) for kind in _at(wanted, path) for word in _words(kind, of_key=bool(key))))
    return f"; use {'one of ' if len(words) > 1 else ''}{', '.join(words)}" if 0 < len(words) <= CHOICES_MAX else ""


def _at(wanted: object, path: str | None) -> list[inspect.Type]:
    """Return the types that a value may have at a path of msgspec's (``a.b[0].c``) inside of a value of a type."""
    reached = list(_choices(inspect.type_info(wanted)))
    for step in re.findall(r"[^.\[\]]+(?![^\[]*\])|\[[^\]]*\]", path or ""):
        reached = [kind for outer in reached for inner in _inside(outer, step) for kind in _choices(inner)]
    return reached


def _choices(kind: inspect.Type) -> Iterator[inspect.Type]:
    """Yield the types of a union, or the only one."""
    match kind:
        case inspect.UnionType(types=types):
            for each in types:
                yield from _choices(each)
        case inspect.Metadata(type=within):
            yield from _choices(within)
        case _:
            yield kind


def _inside(kind: inspect.Type, step: str) -> Iterator[inspect.Type]:
    """Yield the type of a field, of a tag too, or of an entry: ``[3]`` or ``[...]``."""
    match kind:
        case inspect.StructType(tag_field=tag_field, tag=tag) if tag is not None and tag_field == step:
            yield inspect.LiteralType((tag,))
        case inspect.StructType(fields=fields) | inspect.DataclassType(fields=fields):
            yield from (field.type for field in fields if field.encode_name == step)
        case inspect.DictType(value_type=value):
            yield value
        case inspect.TupleType(item_types=items):
            yield items[int(step[1:-1])]
        case inspect.CollectionType(item_type=item):
            yield item


def _words(kind: inspect.Type, *, of_key: bool) -> Iterable[object]:
    """Return the values that an enumeration or a literal allows; ``of_key``: those of an object's keys."""
    match kind.key_type if of_key and isinstance(kind, inspect.DictType) else kind:
        case inspect.EnumType(cls=members):
            return [member.value for member in members]
        case inspect.LiteralType(values=values):
            return values
    return ()


def _fields_of(kind: object) -> set[str]:
    """Return the names of all fields that may occur anywhere in a value of a type."""
    _, structures = msgspec.json.schema_components([kind])
    return {name for each in structures.values() for name in each.get("properties", ())}


def _home_of(name: str, wanted: object) -> str:
    """Return the path of the first object in a value of a type that has a field of this name; empty if none has."""
    left, seen = [("", kind) for kind in _choices(inspect.type_info(wanted))], set[type]()
    while left:
        (path, kind), *left = left
        match kind:
            case inspect.StructType(cls=cls, fields=fields) | inspect.DataclassType(cls=cls, fields=fields):
                if cls in seen:
                    continue
                if name in {field.encode_name for field in fields}:
                    return path or "the outermost object"
                seen.add(cls)
                left += [(f"{path}.{f.encode_name}".strip("."), inner) for f in fields for inner in _choices(f.type)]
            case inspect.DictType(value_type=inner) | inspect.CollectionType(item_type=inner):
                left += [(path, each) for each in _choices(inner)]
    return ""


def _plain(error: Exception, whole: str, field: str, kinds: Mapping[str, str]) -> str:
    if isinstance(error, RecursionError):
        return "JSON is nested too deeply"
    if isinstance(error, UnicodeError):
        return "the text is not UTF-8"
    if not isinstance(error, msgspec.ValidationError):
        return "JSON is incomplete" if str(error) == "Input data was truncated" else str(error)
    found = _PLACE.fullmatch(str(error))
    message, key, path = found.groups() if found else (str(error), None, None)
    path = ".".join(filter(None, (field, path))).replace(".[", "[")
    place = f"a key of {path or whole}" if key else path or whole
    for pattern, form in _MATCHERS:
        if match := pattern.fullmatch(message):
            values = [_in_words(value, kinds) for value in match.groups()]
            if len(values) == 1 and form.count("{}") == 0:
                return form.format(place=f"{path}.{values[0]}" if path else values[0])
            if values == [kinds["int"], kinds["float"]]:
                values[1] = "a fraction"
            return form.format(*values, place=place)
    return message if message.removeprefix("[").startswith(path) else f"{place}: {message}"  # it may name the field


def _in_words(value: str, kinds: Mapping[str, str]) -> str:
    """Return one or several types in words, or a limit without trailing zeros."""
    if set(value.split(" | ")) <= {*kinds, "null"}:
        return " or ".join(kinds.get(kind, kind) for kind in value.split(" | "))
    return value.removesuffix(".0").replace("\\\\", "\\")  # a pattern comes as Python writes it


def host_and_port(text: str, field: str) -> tuple[str, int]:
    """Return host and port of "HOST:PORT"; port 0 is any free one. Raises ValueError that names ``field``."""
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > PORT_MAX:
        raise ValueError(f"{field} must be HOST:PORT, not {text!r}")
    return host.strip("[]"), int(port)


def path_of(kind: type[Path], value: object) -> Path:
    """Return a setting that is a path. Raises TypeError in msgspec's words, to which it adds the setting's name."""
    if isinstance(value, Path):
        return value
    try:
        return kind(msgspec.convert(value, str))
    except msgspec.ValidationError as error:
        raise TypeError(str(error)) from None


def decode_json(data: bytes | str, kind: type[T]) -> T:
    """Return a stranger's JSON as a value. Raises msgspec.DecodeError, also if it is nested too deeply or no text."""
    try:
        return msgspec.json.decode(data, type=kind)
    except (RecursionError, UnicodeError) as error:
        raise msgspec.DecodeError(why_invalid(error)) from None


def read_answer(body: bytes, kind: type[T]) -> T:
    """Return an answer in JSON as a value; numbers may be text there, but are finite. Raises msgspec's errors."""
    try:
        return msgspec.json.decode(body, type=kind, strict=_NO_NUMBER.search(body) is not None)
    except (RecursionError, UnicodeError) as error:
        raise msgspec.DecodeError(why_invalid(error)) from None
