"""Sends a robot every read-only request, so that robots without recordings can be compared.

The caller names the read-only operations from a door's table, as recordings know no door.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from roboglot.clients.errors import ClientError
from roboglot.model.clock import Clock
from roboglot.model.tap import Direction, Exchange
from roboglot.recording.lines import Target
from roboglot.recording.replaying import Replay

ROUNDS = 3
PERIOD = 0.5  # s between two rounds
BEFORE = {"robomaster": ("command",)}  # first requests of a session


def questions(door: str, operations: Iterable[str], rounds: int = ROUNDS) -> list[Exchange]:
    """Return requests of these operations without parameters, as if they had been recorded; each has one reply."""
    found: list[Exchange] = []
    listed = sorted(set(operations))
    for turn in range(rounds):
        first = BEFORE.get(door, ()) if turn == 0 else ()
        for operation in (*first, *listed):
            stamp = turn * PERIOD
            rest = ("probe", door, "probe", "")
            found.append(Exchange(stamp, *rest, Direction.REQUEST, operation, _payload(door, operation, len(found))))
            found.append(Exchange(stamp, *rest, Direction.REPLY, operation, b""))
    return found


async def probe(target: Target, operations: Iterable[str], clock: Clock) -> Sequence[Exchange]:
    """Send these operations to a robot and return the session. Raises ClientError if it cannot be reached."""
    return await asked_again(questions(target.door, operations), target, clock, fast=True)


async def asked_again(
    recorded: Sequence[Exchange], target: Target, clock: Clock, *, fast: bool = False
) -> Sequence[Exchange]:
    """Replay recorded requests to a robot and return the session. Raises ClientError."""
    try:
        return await Replay(recorded, target, clock, fast=fast).run()
    except* ClientError as errors:
        raise first_of(errors) from None


def first_of(errors: BaseExceptionGroup[BaseException]) -> BaseException:
    """Return the first error of a group, however deep it lies."""
    found: BaseException = errors
    while isinstance(found, BaseExceptionGroup):
        found = found.exceptions[0]
    return found


def reads_only(exchanges: Sequence[Exchange], reads: Iterable[str]) -> list[Exchange]:
    """Return the exchanges of read-only operations, and those that open a session."""
    kept = set(reads) | {operation for first in BEFORE.values() for operation in first}
    return [exchange for exchange in exchanges if exchange.operation in kept]


def _payload(door: str, operation: str, number: int) -> bytes:
    match door:
        case "slamware":
            return f"{operation}\n\n".encode()
        case "robomaster":
            return f"{operation};".encode()
        case "visual":
            kind, request = operation.split()
            mode = "" if request == "inquiry" else request
            frame = f'{{"type": "{kind}", "id": "probe{number}", "target_id": [], "describe": "", "style": "", '
            return (frame + f'"operate": "inquiry", "mode": "{mode}", "condition": "", "body": ""}}').encode()
        case _:
            return b"{}"
