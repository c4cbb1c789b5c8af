"""Interface of a fleet to the socket behind ``roboglot fleet``, wherever its shards run."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Protocol

from roboglot.shards.plan import FleetPlan
from roboglot.shards.supervisor import Shard


class FleetHost(Protocol):
    """Keeps the shards of one plan up."""

    plan: FleetPlan
    folder: Path

    @property
    def shards(self) -> Mapping[str, Shard]:
        """All shards by name."""

    @property
    def nursery(self) -> int:
        """The process that shards are forked from; 0 if they are not."""

    @property
    def stores_here(self) -> bool:
        """True if robots' data is stored in folders of this machine."""

    async def start(self) -> float:
        """Start all; returns s until the first could start."""

    async def close(self) -> None:
        """End what ends with this program."""

    async def stop(self, shard: Shard) -> None:
        """Stop a shard and leave it stopped."""

    async def restart(self, shard: Shard) -> None:
        """Stop it if it runs, start it, and wait until it is ready or has failed."""

    async def reset(self, shard: Shard) -> None:
        """Restart it with nothing stored."""
