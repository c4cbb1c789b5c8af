"""Reads a declarative TOML file into a typed structure; errors name file, line and mistake.

Knows no worlds and no robots: the structure is the caller's.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from functools import lru_cache
from pathlib import Path
from typing import TypeVar, cast

import msgspec

from roboglot.text_files import convert_toml, own_text_of
from roboglot.validation import why_invalid

T = TypeVar("T")
FILE_BYTES_MAX = 4_000_000
DECODED_MAX = 8  # files cached


class BadFile(ValueError):
    """A world or body file that cannot be used; the message names file, place and mistake."""


def read_toml(path: Path, structure: type[T]) -> T:
    """Return the content of ``path`` as a ``structure``. Raises BadFile."""
    text = text_below(path, FILE_BYTES_MAX)
    try:
        return cast(T, _decoded(text, cast(Hashable, structure)))
    except msgspec.ValidationError as error:
        why = why_invalid(error, "the file", wanted=structure)
        raise BadFile(f"{path}{_line_of(text, str(error))}: {why}") from None
    except ValueError as error:
        raise BadFile(f"{path}: {error}") from None


def text_below(path: Path, most: int) -> str:
    """Return the text of a file of at most so many characters. Raises BadFile."""
    try:
        return own_text_of(path, most)
    except OSError as error:
        raise BadFile(f"{path}: {error.strerror}") from None
    except ValueError as error:
        raise BadFile(f"{path}: {error}") from None


@lru_cache(maxsize=DECODED_MAX)
def _decoded(text: str, structure: object) -> object:
    """Return the (frozen) structure of a text, cached: a hundred robots of a kind decode their body once."""
    return convert_toml(text, cast(type[object], structure), strict=False)


def _line_of(text: str, message: str) -> str:
    """Return ``:line`` of the start of the message's path ``$.floors[1].walls[3]``; empty if unknown."""
    path = re.search(r"at `\$([^`]*)`", message)
    steps = re.findall(r"\.(\w+)(?:\[(\d+)\])?", path[1] if path else "")
    position = 0
    found = False
    for key, index in steps:
        place = _header(text, position, key, int(index or 0)) or _assignment(text, position, key, int(index or 0))
        if place is None:
            break
        position, found = place, True
    unknown = re.search(r"unknown field `([^`]+)`", message)
    if unknown and (key_at := re.compile(rf"\b{re.escape(unknown[1])}\b").search(text, position)):
        position, found = key_at.start(), True
    return f":{text.count(chr(10), 0, position) + 1}" if found else ""


def _header(text: str, start: int, key: str, index: int) -> int | None:
    """Return the end of the ``index``-th ``[[key]]`` (or ``[key]``) after ``start``."""
    headers = list(re.compile(rf"^\s*\[\[?(?:[\w.]*\.)?{re.escape(key)}\]\]?", re.M).finditer(text, start))
    return headers[index].end() if index < len(headers) else None


def _assignment(text: str, start: int, key: str, index: int) -> int | None:
    """Return the place of the ``index``-th inline table of ``key = [ ... ]`` after ``start``."""
    assigned = re.compile(rf"\b{re.escape(key)}\s*=\s*").search(text, start)
    if assigned is None:
        return None
    if not text.startswith("[", assigned.end()):
        return assigned.end()
    depth, seen = 0, -1
    for i in range(assigned.end(), len(text)):
        if text[i] in "[{":
            depth += 1
            if depth == 2:
                seen += 1
                if seen == index:
                    return i
        elif text[i] in "]}":
            depth -= 1
            if depth == 0:
                break
    return assigned.end()
