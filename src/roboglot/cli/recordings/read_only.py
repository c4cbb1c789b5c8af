"""Read-only operations of each protocol, by the doors' own tables: for comparing robots by their URLs."""

from __future__ import annotations

from collections.abc import Iterator

from roboglot.operations import Operation, Right
from roboglot.protocols import DOORS

LASTING = frozenset({"2002", "4001", "5011", "6010", "6013"})  # for dogs: endless streams, or answers in other frames
SENT_AGAIN = frozenset({"GET /api/platform/v1/events"})  # each answer removes events from the next one


def reads(door: str) -> set[str]:
    """Return all read-only operations, in the tap's words."""
    return {name for name, _ in _reading(door)}


def askable(door: str) -> list[str]:
    """Return the read-only operations without required parameters."""
    found = []
    for name, operation in _reading(door):
        needed = any(operation.requires(parameter) for parameter in operation.names)
        match door:
            case "slamware":
                fits = name.startswith("GET ") and "{" not in name and name not in SENT_AGAIN and not needed
            case "robomaster":
                fits = name.endswith(" ?") and not operation.names
            case "visual":
                fits = name.endswith((" inquiry", " all", " map", " preset"))
            case _:
                fits = name not in LASTING and not needed
        if fits:
            found.append(name)
    return found


def _reading(door: str) -> Iterator[tuple[str, Operation[str] | Operation[int]]]:
    (kind,) = (kind for kind in DOORS if kind.name == door)
    table = kind.table()
    if door == "visual":  # its table lists functions for programs; frames are meant here
        from roboglot.protocols.visual import dispatch  # noqa: F401 - fills the table
        from roboglot.protocols.visual.table import TABLE

        table = TABLE
    for operation in table:
        if operation.right is Right.SEE:
            key = operation.key
            yield (str(int(key)) if isinstance(key, int) else str(key)), operation
