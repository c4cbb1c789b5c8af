"""What every door is to the runtime: something that starts, tells its addresses, and closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol


@dataclass(frozen=True, slots=True)
class Endpoint:
    """One address of a door for the start screen, with a line to copy that tries it (empty: none)."""

    label: str
    address: str
    try_line: str = ""


class Door(Protocol):
    """Listens from the end of ``start`` to ``close``; both are called once, on the running loop."""

    name: str

    async def start(self) -> None:
        """Bind and listen; raises OSError naming the address that is taken."""

    async def close(self) -> None:
        """Stop listening and end what clients began; within a second."""

    @property
    def endpoints(self) -> Sequence[Endpoint]:
        """Where it listens, after ``start``."""
