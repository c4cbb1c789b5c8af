"""Interface between carriers of frame texts (a gRPC door, a WebSocket) and the service that answers them."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class FrontEnd(Protocol):
    """Receives frames for front ends (code 2001), each kind in order. ``answer`` and ``tell`` must not block."""

    @property
    def longest(self) -> int:
        """Largest frame in bytes; 0 for no limit."""

    def answer(self, text: str) -> None:
        """Send the answer to a request: feedback or a response."""

    def tell(self, text: str) -> None:
        """Send an event of a task."""

    async def room(self) -> None:
        """Wait for room in the queue; programs wait with it."""


class FrameRelay(Protocol):
    """Takes frames from front ends and hands frames back to them."""

    async def receive(self, text: str) -> None:
        """Handle a frame from a front end (code 2002). Never raises for its content; errors are answered by frames."""

    def attach(self, front_end: FrontEnd) -> Callable[[], None]:
        """Pass every frame for front ends (code 2001) to ``front_end``; return a function that detaches it."""
