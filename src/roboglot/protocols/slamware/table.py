"""Table of the REST door's operations.

A handler registers under its contract key ("GET /api/…"). Its parameters are read by name from the path and the query;
``body`` is the decoded JSON body, or the raw one if its type is ``bytes``; with a default it may be missing.
The result is the answer: None an empty 200 (null if the handler may also return something else), ``NO_CONTENT`` an
empty 204, ``bytes`` a binary body, a ``Text`` a string that some clients want as plain text, anything else JSON.
"""

from __future__ import annotations

from enum import Enum

from roboglot.model.components.mapping.annotations import MapAnnotations
from roboglot.model.components.mapping.localization import Localization
from roboglot.model.components.mapping.map_memory import MapMemory
from roboglot.model.components.mapping.mapping import Mapping
from roboglot.model.components.mapping.places import Places
from roboglot.operations import Operation, OperationTable, Right
from roboglot.protocols.slamware.routes import BEYOND
from roboglot.values import dataclass

TABLE: OperationTable[str] = OperationTable("slamware")


@dataclass(frozen=True, slots=True)
class Text:
    """String that the manual calls text/plain, but which most clients expect as a JSON string."""

    value: str


class NoContent(Enum):
    """Answer of operations that the manual ends with 204."""

    NO_CONTENT = 204


NO_CONTENT = NoContent.NO_CONTENT


DRAWN = {MapAnnotations, MapMemory, Places}
ON_MAP = ("/api/multi-floor/", "POST /api/core/motion/v1/actions")  # others that look up what lies on the map


def concerns_map(operation: Operation[str]) -> bool:
    """Return whether an operation reads what lies on the map: it has to wait while another map comes into use."""
    return not DRAWN.isdisjoint(operation.needs | operation.some) or any(part in operation.key for part in ON_MAP)


def changes_map(operation: Operation[str]) -> bool:
    """Return whether an operation changes the map, what lies on it, or the robot's place: a load would undo that."""
    placed = not {Localization, Mapping}.isdisjoint(operation.needs | operation.some)
    return operation.right is not Right.SEE and (placed or concerns_map(operation))


def implemented() -> set[str]:
    """Return the keys of the contract's complete operations."""
    return TABLE.implemented() - {row.key for row in BEYOND}


partly = TABLE.partly
