"""Another who answers in a robot's place: doors that have understood what a client asks ask it, not their chapters.

So a robot can be played back from a recording with everything of its doors: their ports, framing, certificates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Collection
from pathlib import Path
from typing import NamedTuple


class Recorded(NamedTuple):
    """A file of which a robot is played back, as ``robot`` of it; its first and last instant in ns since 1970.

    ``others``: the other robots of the file.
    """

    path: Path
    robot: str
    others: tuple[str, ...]
    first: int
    last: int


class StandInReply(NamedTuple):
    """One answer in the protocol's own bytes; ``status`` as in the tap; ``last``: no other follows."""

    payload: bytes
    status: str
    last: bool = True


class StandIn(ABC):
    """Answers for one robot at all of its doors. ``recorded``: the file that it plays back, if it is one."""

    recorded: Recorded | None = None

    @abstractmethod
    def answer(self, door: str, operation: str, payload: bytes, *, reads: bool) -> AsyncIterator[StandInReply]:
        """Yield the answers, each when it is time for it; ``reads``: the request changes nothing.

        Send each before you wait for anything else: so it keeps its place among the pushes. Raises NotFound for what
        cannot be answered.
        """

    @abstractmethod
    def first_push(self, door: str, operation: str) -> bytes | None:
        """Return the first push of this kind, for what must be known before it comes; None: there is none."""

    @abstractmethod
    def join(self, door: str, send: Callable[[str, bytes], None], reads: Collection[str] = ()) -> Callable[[], None]:
        """Have pushes of ``door`` go to ``send`` (operation, payload) from now on; returns what ends it.

        ``reads``: operations that change nothing, where requests do not show it.
        """
