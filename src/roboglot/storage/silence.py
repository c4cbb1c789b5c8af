"""Watch over robots' homes: frees those whose program shows no sign any more, so that the next one need not wait.

A program that starts on a robot's home would wait ``LEASE`` s for a sign of the old one, after the time in which the
cluster noticed its end and started the new one. Who watches all the while waits meanwhile.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection
from dataclasses import dataclass

from roboglot.storage.homes import Homes
from roboglot.storage.residence import LEASE, PERIOD, uptime
from roboglot.storage.transactions import DatabaseError

log = logging.getLogger(__name__)
GAP_MAX = 2.0  # s without a check after which silence is counted from zero


@dataclass(frozen=True, slots=True)
class _Sight:
    """First sighting of a program at its current number of renewals, with its time."""

    renewals: int
    since: float


class Silence:
    """Of the programs that run ``robots``. Counts by this machine's uptime.

    The registry may have been out of reach for the programs too while it was for us: such a time counts for none.
    """

    def __init__(self, homes: Homes, robots: Collection[str], now: Callable[[], float] = uptime) -> None:
        self._homes, self._robots, self._now = homes, frozenset(robots), now
        self._seen: dict[str, _Sight] = {}
        self._looked = -float("inf")
        self._done: dict[str, int] = {}  # programs whose robots were freed, with their renewals by then

    async def look(self) -> list[str]:
        """Look once; return the robots that were freed. Raises DatabaseError."""
        began = self._now()
        signs = await self._homes.signs()
        ended = self._now()
        if ended - self._looked > GAP_MAX:
            self._seen.clear()
        self._looked = ended
        self._done = {holder: count for holder, count in self._done.items() if signs.get(holder) == count}
        self._seen = {
            holder: sight if (sight := self._seen.get(holder)) and sight.renewals == count else _Sight(count, ended)
            for holder, count in signs.items()
            if holder not in self._done
        }
        silent = {holder: sight.renewals for holder, sight in self._seen.items() if began - sight.since >= LEASE}
        freed = await self._homes.free(silent, self._robots) if silent else []
        self._done |= silent
        for robot in freed:
            log.warning("robot %s is free: its program showed no sign for %g s", robot, LEASE)
        return freed

    async def look_always(self) -> None:
        """Look again and again, also when the registry cannot be reached."""
        while True:
            try:
                await self.look()
            except DatabaseError as error:
                log.warning("the registry of robots cannot be reached: %s", error)
            await asyncio.sleep(PERIOD)
