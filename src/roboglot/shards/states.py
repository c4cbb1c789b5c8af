"""Shards of a fleet as the program that keeps them up sees them: their states, last reports and log files."""

from __future__ import annotations

import asyncio
import logging
import socket
from collections.abc import Callable
from enum import StrEnum
from pathlib import Path

from roboglot.shards.messages import Beat, Ready
from roboglot.shards.plan import FleetPlan, ShardPlan

log = logging.getLogger(__name__)
LOG_FILE = "log"
DETACHED = "detached"  # file in the fleet's folder: the cluster on which its shards outlive `fleet up`
LOG_MAX = 10 << 20  # bytes of a shard's log from which the next start begins a new one


class State(StrEnum):
    """State of a shard."""

    WAITING = "waiting"  # for its turn
    STARTING = "starting"
    READY = "ready"
    STOPPING = "stopping"
    STOPPED = "stopped"  # by request
    FAILED = "failed"  # retried, unless its settings are wrong


class FleetEnds(Exception):
    """The fleet ends, so no shard reaches the state that a command waits for."""


class Shard:
    """One shard: its state and its last report."""

    def __init__(self, number: int, plan: ShardPlan, folder: Path) -> None:
        self.number, self.plan, self.folder = number, plan, folder
        self.state = State.WAITING
        self.pid = self.restarts = self.deaths = 0  # deaths: crashes in a row
        self.slow_for = 0  # checks in a row
        self.since = 0.0  # s by the loop's clock: start of the state
        self.heard = 0.0  # s by the loop's clock
        self.silent = 0.0  # s without a heartbeat, of a ready one that should have sent some; 0: it sends them
        self.killed_at = 0.0  # s by the loop's clock; 0: not in this state
        self.beat = Beat(0.0, 0, 0.0)
        self.ready: Ready | None = None
        self.reason = ""  # of its last end
        self.cause = ""  # of its next end, if that is known before
        self.hopeless = False
        self.link: socket.socket | None = None
        self.again: asyncio.TimerHandle | None = None

    @property
    def trouble(self) -> str:
        """Silence of a ready one, else the reason of its last end; empty without either."""
        why = self.reason
        if self.silent and self.state is State.READY:
            why = f"not answering for {self.silent:.0f} s"
        return why

    @property
    def is_settled(self) -> bool:
        """True if it is ready, has failed, or was stopped."""
        return self.state in (State.READY, State.FAILED, State.STOPPED)


class Shards(dict[str, Shard]):
    """All shards of a plan by name, each with its folder in ``folder``."""

    def __init__(self, plan: FleetPlan, folder: Path) -> None:
        super().__init__(
            (shard.name, Shard(number, shard, folder / "shards" / shard.name))
            for number, shard in enumerate(plan.shards, start=1)
        )
        self._changed = asyncio.Event()  # set with every change of a state
        self._ends, self._reports_hopeless = False, False
        self._loop = asyncio.get_running_loop()

    def turn_to(self, shard: Shard, state: State) -> None:
        """Change a shard's state; one that was stopped by request has no reason."""
        shard.state, shard.since, shard.killed_at, shard.silent = state, self._loop.time(), 0.0, 0.0
        if state is State.STOPPED:
            shard.reason = ""
        self._changed.set()

    def refused(self, shard: Shard) -> None:
        """Log a hopeless shard's reason, once for all. Before ``report_hopeless``, `fleet up` may end with it."""
        same = (other for other in self.values() if other.hopeless and other.reason == shard.reason)
        if self._reports_hopeless and all(other is shard for other in same):
            log.error("shard %s cannot start: %s", shard.plan.name, shard.reason)

    def report_hopeless(self) -> None:
        """Log the reason of each hopeless shard, as ``refused`` does from now on."""
        self._reports_hopeless = True
        reasons = {shard.reason: shard for shard in reversed(self.values()) if shard.hopeless}
        for shard in reversed(reasons.values()):
            log.error("shard %s cannot start: %s", shard.plan.name, shard.reason)

    def end(self) -> None:
        """Let every wait fail that has not come to its end, and all further ones."""
        self._ends = True
        self._changed.set()

    async def until(self, condition: Callable[[], bool]) -> None:
        """Wait until a condition on shards holds. Raises FleetEnds."""
        while not condition():
            if self._ends:
                raise FleetEnds("the fleet ends")
            self._changed.clear()
            await self._changed.wait()

    async def settle(self) -> None:
        """Wait until every shard is ready, has failed, or was stopped."""
        await self.until(lambda: all(shard.is_settled for shard in self.values()))


def detached_on(folder: Path) -> str:
    """Return the cluster on which shards of this folder's fleet may run without `fleet up`; empty: none."""
    try:
        return (folder / DETACHED).read_text(encoding="utf-8")
    except OSError:
        return ""


def rotate(log: Path) -> None:
    """Rename a log that is too long; it replaces the last such one."""
    if log.exists() and log.stat().st_size > LOG_MAX:
        log.replace(log.with_suffix(".old"))
