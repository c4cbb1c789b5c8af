"""The seam between a carrier of frame texts (a gRPC door, a WebSocket) and whoever answers them. Knows neither."""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class FrameRelay(Protocol):
    """Takes frames from front ends and hands frames back to them."""

    async def receive(self, text: str) -> None:
        """One frame from a front end (code 2002); never raises for what is in it: the answer is a frame, too."""

    def subscribe(self, send: Callable[[str], None]) -> Callable[[], None]:
        """Call ``send`` with every frame for front ends (code 2001), in order; returns what ends it. Must be quick."""
