"""Interface between carriers of frame texts (a gRPC door, a WebSocket) and the program service's door."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class FrontEnd(Protocol):
    """Receiver of frames for front ends (code 2001), each kind in order. ``answer`` and ``publish`` must be quick."""

    @property
    def longest(self) -> int:
        """Most bytes of a frame; 0: no limit."""

    def answer(self, text: str) -> None:
        """Send an answer to a request: feedback or a response."""

    def publish(self, text: str) -> None:
        """Send a report of a task."""

    async def drain(self) -> None:
        """Wait until more can be sent; programs wait for this."""


class FrameRelay(Protocol):
    """Takes frames from front ends and sends frames back to them."""

    async def receive(self, text: str) -> None:
        """Take one frame from a front end (code 2002). Never raises for its contents: errors are answered by frames."""

    def attach(self, front_end: FrontEnd) -> Callable[[], None]:
        """Send every frame for front ends (code 2001) to this one; return a function that ends it."""
