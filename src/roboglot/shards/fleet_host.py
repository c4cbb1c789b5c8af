"""Interface of a fleet to the socket behind ``roboglot fleet``, wherever its shards run."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Protocol

from roboglot.shards.plan import FleetPlan
from roboglot.shards.states import Shard, Shards


class FleetHost(Protocol):
    """Keeps the shards of one plan up."""

    plan: FleetPlan
    folder: Path
    ended: asyncio.Future[None]  # done when it has to end; with OSError if its shards cannot go on

    @property
    def shards(self) -> Shards:
        """All shards by name."""

    @property
    def nursery(self) -> int:
        """Process id of the nursery; 0 without one."""

    @property
    def stores_here(self) -> bool:
        """True if the robots' data is stored in folders of this machine."""

    async def start(self) -> float:
        """Start all shards; return the time until the first could start, s."""

    async def close(self) -> None:
        """Stop all shards that do not outlive this program."""

    async def stop(self, shard: Shard) -> None:
        """Stop a shard and leave it stopped. Raises FleetEnds."""

    async def restart(self, shard: Shard) -> None:
        """Restart a shard, or start it; return when it is ready or has failed. Raises FleetEnds."""
