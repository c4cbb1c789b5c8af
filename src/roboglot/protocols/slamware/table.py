"""The table of the REST door's operations, and what it has of them.

A handler registers under its contract key ("GET /api/…"). Its parameters come by name from the path and the query;
one named ``body`` is the decoded JSON body, or the bare one if its type is ``bytes``; with a default it may be missing.
What it returns is the answer: None an empty 200 (null where it may be something else), ``NO_CONTENT`` an empty 204,
``bytes`` a binary, a ``Text`` a string that some clients want bare, anything else JSON.
"""

from __future__ import annotations

from enum import Enum

from roboglot.operations import OperationTable
from roboglot.protocols.slamware.routes import BEYOND
from roboglot.values import dataclass

TABLE: OperationTable[str] = OperationTable("slamware")


@dataclass(frozen=True, slots=True)
class Text:
    """A string that the manual calls text/plain, but which most clients want as a JSON string."""

    value: str


class NoContent(Enum):
    """The answer of what the manual says ends with 204."""

    NO_CONTENT = 204


NO_CONTENT = NoContent.NO_CONTENT


def implemented() -> set[str]:
    """Return the keys of the contract's operations that do all that the manual says."""
    return TABLE.implemented() - {row.key for row in BEYOND}


partly = TABLE.partly
