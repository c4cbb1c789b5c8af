"""What every driver is to the fleet: it gives a robot its components at once, and connects when it is started."""

from __future__ import annotations

from typing import Protocol


class Driver(Protocol):
    """Made with a robot that has nothing yet; adds the components that any robot of its protocol has.

    What only some have is added when the robot is reached for the first time.
    """

    async def start(self, *, wait: bool) -> None:
        """Connect from now on. ``wait``: return when the first try is over; never raises for a robot that is away."""

    async def close(self) -> None:
        """Let go of the robot; within a second."""
