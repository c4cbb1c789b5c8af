"""What this door can do: requests by code, and the pushes that it sends. The chapters fill both tables at import."""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

from roboglot.operations import OperationTable
from roboglot.wire.contracts import contract

if TYPE_CHECKING:
    from roboglot.protocols.cyberdog.dog import Dog

operations: OperationTable[int] = OperationTable("cyberdog")


@dataclass(frozen=True, slots=True)
class Call:
    """One request under way.

    A handler returns what is answered (a dict as JSON, a str as it is, None for nothing more); what takes longer
    answers by ``reply`` as often as it likes first.
    """

    code: int
    text: str  # params as it came
    dog: Dog
    reply: Callable[[object], Awaitable[None]]


@dataclass(frozen=True, slots=True)
class Push:
    """A message from the robot to the app; ``depth`` may wait, then the oldest is dropped."""

    code: int
    depth: int


pushes: dict[int, Push] = {}


def push(code: int, *, depth: int = 10) -> Push:
    """Declare, beside the code that sends it, that ``code`` is pushed."""
    if code in pushes:
        raise ValueError(f"cyberdog: push {code} is declared twice")
    pushes[code] = Push(int(code), depth)
    return pushes[code]


def implemented() -> set[str]:
    """The rows of the contract that are wholly there."""
    whole = {str(int(op.key)) for op in operations if not op.partial} | {str(int(code)) for code in pushes}
    return whole & {row.key for row in contract("cyberdog")}


def partly() -> dict[str, str]:
    """The rows that are there in part, with what they cannot do yet."""
    return {str(int(op.key)): op.partial for op in operations if op.partial}
