"""Contracts: one JSON file per protocol with all of its operations, the reference for coverage.

A file lists chapters, ``["chapter", [row, ...]]``; a row is ``["key", "name"]``, the wire name under which a handler
registers and the vendor's own identifier, or just ``"key"``.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import NamedTuple

import msgspec

from roboglot.text_files import content_of


class Row(NamedTuple):
    """One operation, command, message code or function of a protocol."""

    key: str
    chapter: str
    name: str


@cache
def contract(protocol: str) -> tuple[Row, ...]:
    """Return all rows of ``protocol``, in the manual's order."""
    data = content_of(Path(__file__).with_name(f"{protocol}.json"))
    chapters = msgspec.json.decode(data, type=list[tuple[str, list[str | tuple[str, str]]]])
    return tuple(
        Row(row, chapter, row) if isinstance(row, str) else Row(row[0], chapter, row[1])
        for chapter, rows in chapters
        for row in rows
    )
