"""Contracts: one JSON file per protocol with all of its operations, the reference for coverage.

A row is ``["key", "chapter", "name"]``: the wire name under which a handler registers, the vendor's chapter, and the
vendor's own identifier.
"""

from __future__ import annotations

from functools import cache
from importlib import resources

import msgspec


class Row(msgspec.Struct, frozen=True, array_like=True):
    """One operation, command, message code or function of a protocol."""

    key: str
    chapter: str
    name: str


@cache
def contract(protocol: str) -> tuple[Row, ...]:
    """Return all rows of ``protocol``, in the manual's order."""
    data = (resources.files(__package__) / f"{protocol}.json").read_bytes()
    return msgspec.json.decode(data, type=tuple[Row, ...])
