"""Responder that answers requests in a robot's place: doors pass parsed requests to it instead of their chapters.

Thus a recorded robot is played back behind real doors, with their ports, framing and certificates.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import AsyncIterator, Callable, Collection
from pathlib import Path
from typing import NamedTuple


class Recorded(NamedTuple):
    """Recording that is played back: its file, the robot's name in it, first and last instant in ns since 1970.

    ``others``: the other robots of the file.
    """

    path: Path
    robot: str
    others: tuple[str, ...]
    first: int
    last: int


class ResponderReply(NamedTuple):
    """One answer in the protocol's own bytes; ``status`` as in the tap; ``last``: no further answer follows."""

    payload: bytes
    status: str
    last: bool = True


class Responder(ABC):
    """Answers for one robot at all its doors. ``recorded``: the recording that it plays back, if any."""

    recorded: Recorded | None = None

    @abstractmethod
    def answer(self, door: str, operation: str, payload: bytes, *, reads: bool) -> AsyncIterator[ResponderReply]:
        """Yield the answers, each at its time; ``reads``: the request changes nothing.

        Send each before awaiting anything else, to keep its place among the pushes. Raises NotFound without an answer.
        """

    @abstractmethod
    def first_push(self, door: str, operation: str) -> bytes | None:
        """Return the first recorded push of this kind, or None, for values needed before its time."""

    @abstractmethod
    def join(self, door: str, send: Callable[[str, bytes], None], reads: Collection[str] = ()) -> Callable[[], None]:
        """Pass pushes of ``door`` to ``send`` (operation, payload) from now on; return a function that ends this.

        ``reads``: read-only operations, where requests do not show that.
        """
