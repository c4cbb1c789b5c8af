"""Watches the registry and frees the robots of dead programs, so that their successors need not wait.

Without it, a new program would wait ``LEASE`` s for a sign of life of the old one, after the cluster has detected the
old one's end and started the new one. A watcher's ``LEASE`` s begin with the end itself.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection

from roboglot.hosting.steady_time import uptime
from roboglot.storage.registry_lease import LEASE, PERIOD
from roboglot.storage.robot_registry import RobotRegistry
from roboglot.storage.transactions import FAILURES
from roboglot.transport.log_limiter import LogLimiter
from roboglot.values import dataclass

log = logging.getLogger(__name__)
GAP_MAX = 2.0  # s without a check after which silence is counted from zero


@dataclass(frozen=True, slots=True)
class _Seen:
    """A program's current count of renewals, and the time at which it was first seen."""

    renewals: int
    since: float


class DeadProgramWatch:
    """Watcher of the programs that run ``robots``, by this machine's uptime.

    Time in which the registry is unreachable does not count as silence, as the programs may not have reached it either.
    """

    def __init__(self, registry: RobotRegistry, robots: Collection[str], now: Callable[[], float] = uptime) -> None:
        self._registry, self._robots, self._now = registry, frozenset(robots), now
        self._seen: dict[str, _Seen] = {}
        self._looked = -float("inf")
        self._done: dict[str, int] = {}  # programs whose robots were freed, with their renewals by then

    async def check(self) -> list[str]:
        """Check once; return the freed robots. Raises DatabaseError."""
        began = self._now()
        renewals = await self._registry.renewals()
        ended = self._now()
        if ended - self._looked > GAP_MAX:
            self._seen.clear()
        self._looked = ended
        self._done = {holder: count for holder, count in self._done.items() if renewals.get(holder) == count}
        self._seen = {
            holder: sight if (sight := self._seen.get(holder)) and sight.renewals == count else _Seen(count, ended)
            for holder, count in renewals.items()
            if holder not in self._done
        }
        silent = {holder: sight.renewals for holder, sight in self._seen.items() if began - sight.since >= LEASE}
        freed = await self._registry.free(silent, self._robots) if silent else []
        self._done |= silent
        for robot in freed:
            log.warning("robot %s is free: its program did not renew its claim for %g s", robot, LEASE)
        return freed

    async def run(self) -> None:
        """Check regularly, even after failures of the registry."""
        limited_log = LogLimiter(log)
        while True:
            try:
                await self.check()
            except FAILURES as error:
                limited_log.warning("registry", "the registry of robots fails: %s", error)
            await asyncio.sleep(PERIOD)
