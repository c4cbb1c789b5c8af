"""Values that cross between a program and its host, as JSON.

Plain values stand for themselves. What JSON can't say is an object with the key ``$``: non-finite numbers,
dictionaries whose keys aren't text, and records (a type's name and its fields). Knows nothing of which records exist.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeVar

T = TypeVar("T")

DEPTH_MAX = 32
"""Containers inside containers, in both directions."""
PAIRS_MAX = 128
"""Entries of a dictionary whose keys aren't text: numbers can be chosen so that each costs as much as all before it."""
SEPARATORS = b",[{"
"""Every value of a JSON text but the first follows one of these, and so does every key."""
SEPARATORS_MAX = 100_000
"""In one call's frame: the longest dance has fewer. Texts do not count, see ``Link``."""
_INT_BITS = 63
_INT_BITS_MAX = 4096
_PLAIN = (str, bool, type(None))
_SMALL = 1 << _INT_BITS


@dataclass(slots=True)
class Record:
    """A record as the host sees it: its type's name and the fields that are given.

    The rest have the type's defaults.
    """

    type: str
    fields: Mapping[str, Any] = field(default_factory=dict)


Split = Callable[[object], "tuple[str, Mapping[str, object]] | None"]
Join = Callable[[str, "dict[str, object]"], object]


def split_record(value: object) -> tuple[str, Mapping[str, object]] | None:
    """The host's ``split`` for ``pack``."""
    return (value.type, value.fields) if isinstance(value, Record) else None


def pack(value: object, split: Split = split_record, depth: int = 0) -> object:
    """JSON-ready form.

    Raises TypeError for what can't cross (functions, complex numbers ...), ValueError for too deep or too large.
    """
    if type(value) in _PLAIN or (type(value) is int and -_SMALL < value < _SMALL):
        return value
    if isinstance(value, str):
        return str(value)
    if isinstance(value, int):
        return _pack_int(int(value))
    if isinstance(value, float):
        return float(value) if math.isfinite(value) else {"$": "float", "v": repr(float(value))}
    if depth >= DEPTH_MAX:
        raise ValueError("the value is nested too deeply")
    record = split(value)
    if record is not None:
        name, fields = record
        return {"$": "record", "t": name, "v": {key: pack(item, split, depth + 1) for key, item in fields.items()}}
    if isinstance(value, (list, tuple)):
        return [pack(item, split, depth + 1) for item in value]
    if isinstance(value, Mapping):
        return _pack_mapping(value, split, depth)
    raise TypeError(f"a value of type '{type(value).__name__}' cannot be passed to the robot")


def _pack_mapping(value: Mapping[object, object], split: Split, depth: int) -> object:
    if all(type(key) is str for key in value) and "$" not in value:
        return {key: pack(item, split, depth + 1) for key, item in value.items()}
    if len(value) > PAIRS_MAX:
        raise ValueError(f"a dictionary of more than {PAIRS_MAX} entries is passed to the robot by text keys only")
    return {
        "$": "dict",
        "v": [[pack(key, split, depth + 1), pack(item, split, depth + 1)] for key, item in value.items()],
    }


def _pack_int(value: int) -> object:
    if value.bit_length() <= _INT_BITS:
        return value
    if value.bit_length() > _INT_BITS_MAX:
        raise ValueError("the number is too large to be passed to the robot")
    return {"$": "int", "v": hex(value)}


def separators(text: bytes) -> int:
    """Return how many values a JSON text can have at most, without looking at any."""
    return len(text) - len(text.translate(None, SEPARATORS))


def unpack(packed: object, join: Join = Record) -> Any:
    """The value of a packed form. Raises ValueError for anything ``pack`` doesn't produce.

    The other end may be hostile.
    """
    if type(packed) in _PLAIN or (type(packed) is int and -_SMALL < packed < _SMALL):
        return packed  # the usual case
    return drained(unpacking(packed, join))


def drained(steps: Generator[None, None, T]) -> T:
    """Return what ``steps`` give in the end."""
    try:
        while True:
            next(steps)
    except StopIteration as done:
        result: T = done.value
        return result


def unpacking(packed: object, join: Join = Record, depth: int = 0) -> Generator[None, None, object]:
    """``unpack`` in steps, one for each container, so that other work can be done between them."""
    if depth > DEPTH_MAX:
        raise ValueError("nested too deeply")
    kind = type(packed)
    if kind in _PLAIN or kind is float:  # no match statement here: a frame can hold tens of thousands of values
        return packed
    if isinstance(packed, int):
        if packed.bit_length() > _INT_BITS_MAX:
            raise ValueError("number too large")
        return packed
    if isinstance(packed, list):
        yield
        items = []
        for item in packed:
            items.append(item if type(item) in _PLAIN else (yield from unpacking(item, join, depth + 1)))  # noqa: PERF401 - it yields
        return items
    if not isinstance(packed, dict):
        raise ValueError(f"not a value: {kind.__name__}")
    yield
    if "$" in packed:
        return (yield from _unpacking_tagged(packed, join, depth))
    return (yield from _unpacking_fields(packed, join, depth))


def _unpacking_fields(packed: dict[object, object], join: Join, depth: int) -> Generator[None, None, dict[str, object]]:
    fields = {}
    for key, item in packed.items():
        fields[str(key)] = item if type(item) in _PLAIN else (yield from unpacking(item, join, depth + 1))
    return fields


def _unpacking_tagged(packed: dict[object, object], join: Join, depth: int) -> Generator[None, None, object]:
    match packed:
        case {"$": "record", "t": str(name), "v": dict(fields)}:
            return join(name, (yield from _unpacking_fields(fields, join, depth)))
        case {"$": "float", "v": "nan" | "inf" | "-inf" as text}:
            return float(text)
        case {"$": "int", "v": str(text)} if len(text) <= _INT_BITS_MAX // 4 + 3:
            return int(text, 16)
        case {"$": "dict", "v": list(pairs)} if len(pairs) <= PAIRS_MAX:
            return (yield from _unpacking_pairs(pairs, join, depth))
    raise ValueError(f"not a tagged value: {packed['$']!r:.40}")


def _unpacking_pairs(pairs: list[object], join: Join, depth: int) -> Generator[None, None, dict[object, object]]:
    result = {}
    for pair in pairs:
        match pair:
            case [key, item]:
                hashable = yield from unpacking(key, join, depth + 1)
                if isinstance(hashable, list):
                    hashable = tuple(hashable)
                value = yield from unpacking(item, join, depth + 1)
                try:
                    result[hashable] = value
                except TypeError:
                    raise ValueError("not a dictionary key") from None
            case _:
                raise ValueError("not a pair")
    return result
