"""Tables of this door: requests by code, and the pushes that it sends. The chapters fill both at import."""

from __future__ import annotations

from roboglot.operations import OperationTable
from roboglot.values import dataclass
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import UNPUBLISHED

TABLE: OperationTable[int] = OperationTable("cyberdog")


@dataclass(frozen=True, slots=True)
class Push:
    """A message from the robot to the app; beyond ``depth`` queued ones, the oldest is dropped.

    ``partial``: what it cannot report yet, in plain words; empty when complete.
    """

    code: int
    depth: int
    partial: str = ""


pushes: dict[int, Push] = {}
files: set[int] = set()  # files that ``getFile`` serves besides requests
unread: set[int] = set()  # requests whose params another module parses, JSON or not


def push(code: int, *, depth: int = 10, partial: str = "") -> Push:
    """Declare that ``code`` is pushed, beside the code that sends it."""
    if code in pushes:
        raise ValueError(f"cyberdog: push {code} is declared twice")
    pushes[code] = Push(int(code), depth, partial)
    return pushes[code]


def implemented() -> set[str]:
    """Return the rows of the contract that are complete."""
    return {key for key, partial in _rows().items() if not partial}


def partly() -> dict[str, str]:
    """Return the partial rows, with what they cannot do yet."""
    return {key: partial for key, partial in _rows().items() if partial}


def extras() -> dict[int, bool]:
    """Return codes of real robots that the manual omits, with True if served."""
    there = {int(operation.key) for operation in TABLE} | pushes.keys() | files
    return {code: code in there for code in sorted(UNPUBLISHED)}


def _rows() -> dict[str, str]:
    """Return each served row with what it cannot do; one row may be a request and a push."""
    whys: dict[str, list[str]] = {}
    for key, partial in (
        [(op.key, op.partial) for op in TABLE]
        + [(p.code, p.partial) for p in pushes.values()]
        + [(code, "") for code in files]
    ):
        whys.setdefault(str(int(key)), []).append(partial)
    rows = {row.key for row in contract("cyberdog")}
    return {key: "; ".join(filter(None, why)) for key, why in whys.items() if key in rows}
