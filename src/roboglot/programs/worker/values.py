"""Values sent between a program and its host, as JSON.

Plain values stay as they are. Values outside JSON become an object with the key ``$``: non-finite numbers, integers
beyond 63 bits, dictionaries whose keys aren't text, and records (type name and fields). Knows no record types.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping
from dataclasses import field
from typing import Any, TypeVar

from roboglot.values import dataclass

T = TypeVar("T")

DEPTH_MAX = 32
"""Deepest nesting of containers, in both directions."""
PAIRS_MAX = 128
"""Most entries of a dictionary whose keys aren't text: numbers can be chosen so that all their hashes collide."""
SEPARATORS = b",[{"
"""Characters before every key and every value, but the first, of a JSON text."""
SEPARATORS_MAX = 100_000
"""Most separators in a call's frame, more than in the longest dance. Those in texts do not count, see ``link``."""
_INT_BITS = 63
_INT_BITS_MAX = 4096
_PLAIN = (str, bool, type(None))
_SMALL = 1 << _INT_BITS


@dataclass(slots=True)
class Record:
    """The host's form of a record: its type's name and the given fields.

    All other fields have the type's defaults.
    """

    type: str
    fields: Mapping[str, Any] = field(default_factory=dict)


Split = Callable[[object], "tuple[str, Mapping[str, object]] | None"]
Join = Callable[[str, "dict[str, object]"], object]


def split_record(value: object) -> tuple[str, Mapping[str, object]] | None:
    """Return type and fields of a host record, None for other values; the host's ``split`` for ``pack``."""
    return (value.type, value.fields) if isinstance(value, Record) else None


def pack(value: object, split: Split = split_record, depth: int = 0) -> object:
    """Return a value in JSON types.

    Raises TypeError for types that can't be sent (functions, complex numbers ...), ValueError for values nested too
    deeply or too large.
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
    """Return an upper bound for the number of values in a JSON text, without parsing it."""
    return len(text) - len(text.translate(None, SEPARATORS))


def unpack(packed: object, join: Join = Record) -> Any:
    """Return the value of a packed form. Raises ValueError for anything that ``pack`` doesn't produce.

    The sender may be hostile.
    """
    if type(packed) in _PLAIN or (type(packed) is int and -_SMALL < packed < _SMALL):
        return packed  # the usual case
    return drained(unpacking(packed, join))


def drained(steps: Generator[None, None, T]) -> T:
    """Run ``steps`` to the end; return their result."""
    try:
        while True:
            next(steps)
    except StopIteration as done:
        result: T = done.value
        return result


def unpacking(packed: object, join: Join = Record, depth: int = 0) -> Generator[None, None, object]:
    """Unpack in steps, one per container, so that other work can be done in between; return the value."""
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
