"""What this door can do: requests by code, and the pushes that it sends. The chapters fill both tables at import."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeVar

from roboglot.operations import OperationTable
from roboglot.wire.contracts import contract
from roboglot.wire.cyberdog.codes import UNPUBLISHED

if TYPE_CHECKING:
    from roboglot.protocols.cyberdog.context import Context

Answer = TypeVar("Answer")
TABLE: OperationTable[int] = OperationTable("cyberdog")


@dataclass(slots=True)  # not frozen: one is made for every request, and frozen ones take four times as long
class Call:
    """One request under way.

    A handler returns what is answered (a dict as JSON, a str as it is, None for nothing more); what takes longer
    answers by ``reply`` as often as it likes first.
    """

    code: int
    text: str  # params as it came
    context: Context
    reply: Callable[[object], Awaitable[None]]
    why: str = ""  # it was refused, in plain words

    def refused(self, answer: Answer, why: str) -> Answer:
        """Return ``answer``, which says no; ``why`` is for the log and who watches the exchange."""
        self.why = why
        return answer


@dataclass(frozen=True, slots=True)
class Push:
    """A message from the robot to the app; ``depth`` may wait, then the oldest is dropped.

    ``partial`` says in plain words what it cannot report yet; empty when it is whole.
    """

    code: int
    depth: int
    partial: str = ""


pushes: dict[int, Push] = {}
files: set[int] = set()  # what ``getFile`` serves beside the requests
unread: set[int] = set()  # requests whose params another module reads, JSON or not


def push(code: int, *, depth: int = 10, partial: str = "") -> Push:
    """Declare, beside the code that sends it, that ``code`` is pushed."""
    if code in pushes:
        raise ValueError(f"cyberdog: push {code} is declared twice")
    pushes[code] = Push(int(code), depth, partial)
    return pushes[code]


def implemented() -> set[str]:
    """The rows of the contract that are wholly there."""
    return {key for key, partial in _rows().items() if not partial}


def partly() -> dict[str, str]:
    """The rows that are there in part, with what they cannot do yet."""
    return {key: partial for key, partial in _rows().items() if partial}


def extras() -> dict[int, bool]:
    """Codes of real robots that the text leaves out, and whether they are there."""
    there = {int(operation.key) for operation in TABLE} | pushes.keys() | files
    return {code: code in there for code in sorted(UNPUBLISHED)}


def _rows() -> dict[str, str]:
    """What each row that is there cannot do; one row may be a request and a push."""
    whys: dict[str, list[str]] = {}
    for key, partial in (
        [(op.key, op.partial) for op in TABLE]
        + [(p.code, p.partial) for p in pushes.values()]
        + [(code, "") for code in files]
    ):
        whys.setdefault(str(int(key)), []).append(partial)
    rows = {row.key for row in contract("cyberdog")}
    return {key: "; ".join(filter(None, why)) for key, why in whys.items() if key in rows}
