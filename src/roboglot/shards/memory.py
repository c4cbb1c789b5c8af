"""Memory that the shards of a plan take, compared with what this machine has free."""

from __future__ import annotations

import contextlib
from pathlib import Path

from roboglot.shards.plan import FleetPlan

MEMINFO = Path("/proc/meminfo")
OWN, WORLD, ROBOT = 170 << 20, 30 << 20, 3 << 20  # bytes: nursery and supervisor; a world; each robot, doors open
GIGABYTE = 1 << 30


def shortage(plan: FleetPlan) -> str:
    """Return why the shards may not fit into this machine's memory; empty if they do, or if it does not say."""
    robots = sum(len(shard.robots) for shard in plan.shards)
    needed, free = OWN + WORLD * len(plan.shards) + ROBOT * robots, _available()
    if not free or needed <= free:
        return ""
    return (
        f"{len(plan.shards)} worlds with {robots} robots take about {needed / GIGABYTE:.1f} GB of memory, and this"
        f" machine has {free / GIGABYTE:.1f} GB free: it may end some of them"
    )


def _available() -> int:
    """Return how much memory new processes can have, bytes; 0 if the system does not report that."""
    with contextlib.suppress(OSError, ValueError, IndexError):
        for line in MEMINFO.read_text().splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024
    return 0
