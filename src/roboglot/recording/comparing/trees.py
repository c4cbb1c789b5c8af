"""A payload as a tree of values, in any protocol: JSON as it is, text commands as words, other bytes by length."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import msgspec

LEAVES_MAX = 5000  # per payload
_number = re.compile(r"[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?")
_sequence = re.compile(r"\s*\bseq\s+\d+\s*(?=;|$)")
_decode = msgspec.json.Decoder().decode


def tree(payload: bytes) -> object:
    """Return the values of a payload."""
    body = payload.partition(b"\n\n")[2] or payload
    if body[:1] in (b"{", b"["):
        try:
            return _decode(body)
        except (msgspec.DecodeError, UnicodeDecodeError, RecursionError):
            pass
    try:
        text = payload.decode()
    except UnicodeDecodeError:
        return {"bytes": len(payload)}
    return [_value(word) for word in _sequence.sub("", text).rstrip(" ;\r\n").split()]


def _value(word: str) -> object:
    return float(word) if _number.fullmatch(word) else word


def leaves(value: Any, path: str = "$") -> Iterator[tuple[str, Any]]:
    """Yield each leaf with its path; an empty list or object is a leaf."""
    stack, count = [(path, value)], 0
    while stack and count < LEAVES_MAX:
        where, found = stack.pop()
        if isinstance(found, dict) and found:
            stack += [(f"{where}.{key}", found[key]) for key in sorted(found, reverse=True)]
        elif isinstance(found, list) and found:
            stack += [(f"{where}[{index}]", found[index]) for index in range(len(found) - 1, -1, -1)]
        else:
            count += 1
            yield where, found


def kind_of(value: object) -> str:
    """Return the JSON type of a value."""
    if isinstance(value, bool):
        return "boolean"
    if isinstance(value, int | float):
        return "number"
    kinds: dict[type, str] = {str: "string", dict: "object", list: "array"}
    return kinds.get(type(value), "null")
