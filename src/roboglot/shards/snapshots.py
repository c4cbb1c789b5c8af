"""States and pictures of robots in all worlds, from their consoles, at most once a second and only on demand."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Coroutine
from functools import partial
from typing import Generic, TypeVar

from roboglot.agents.console import ConsoleClient, Refused
from roboglot.shards.fleet_host import FleetHost
from roboglot.shards.states import Shard, State

PERIOD = 1.0  # s for which an answer is reused
ANSWER_MAX = 2.0  # s for which a page with many robots waits for one of them
AT_ONCE_MAX = 8  # requests to consoles in progress
SHOWN = ("about", "battery", "actions", "faults", "safety", "control", "parts", "pose")
T = TypeVar("T")


class _Newest(Generic[T]):
    """Newest answer for each robot: less than ``PERIOD`` old, or pending."""

    def __init__(self) -> None:
        self._found: dict[str, tuple[float, asyncio.Task[T]]] = {}  # with when it was begun, s of the loop

    async def get(self, robot: str, look: Callable[[], Coroutine[None, None, T]]) -> T:
        """Return the result of ``look``, or a recent one. Raises its errors."""
        loop = asyncio.get_running_loop()
        began, task = self._found.get(robot, (-PERIOD, None))
        if task is None or (task.done() and loop.time() - began >= PERIOD):
            task = loop.create_task(look())
            self._found[robot] = loop.time(), task
        return await asyncio.shield(task)


class Snapshots:
    """Polls the robots of one fleet, once for all pages."""

    def __init__(self, fleet_host: FleetHost, client: Callable[[str], ConsoleClient] | None = None) -> None:
        self._fleet_host = fleet_host
        self._client = client or partial(ConsoleClient, seconds=ANSWER_MAX)  # each takes a thread meanwhile
        self._states: _Newest[dict[str, object]] = _Newest()
        self._pictures: _Newest[bytes] = _Newest()
        self._turns = asyncio.Semaphore(AT_ONCE_MAX)

    async def state(self, robot: str) -> dict[str, object]:
        """Return a robot's state from its console, or ``{"error": why}`` without an answer in time.

        Raises LookupError.
        """
        shard = self._home(robot)
        console = self._console(shard)
        if shard.silent:
            return {"error": shard.trouble}

        async def look() -> dict[str, object]:
            if console is None:
                return {"error": "this world has no console"}
            try:
                async with self._turns:
                    found = await console.get(dict, "robots", robot)
            except Refused as refused:
                why = "its console asks for a log-in: sign in there"
                return {"error": why if refused.status == 401 else str(refused)}
            return {name: found[name] for name in SHOWN if name in found}

        try:
            return await asyncio.wait_for(self._states.get(robot, look), ANSWER_MAX)
        except TimeoutError:
            why = "its console does not answer"
            return {"error": why}

    async def picture(self, robot: str) -> bytes:
        """Return the small picture of a robot's map, a PNG. Raises LookupError, Refused."""
        shard = self._home(robot)
        console = self._console(shard)
        if shard.silent:
            raise Refused(shard.trouble)
        if console is None:
            raise Refused("this world has no console")

        async def look() -> bytes:
            async with self._turns:
                return await console.fetch("robots", robot, "map.png")

        return await self._pictures.get(robot, look)

    def _home(self, robot: str) -> Shard:
        return self._fleet_host.shards[self._fleet_host.plan.home_of(robot).name]

    def _console(self, shard: Shard) -> ConsoleClient | None:
        """Return the console of a world; None if the world is not up or has none."""
        if shard.state is not State.READY or shard.ready is None or not shard.ready.console:
            return None
        return self._client(shard.ready.console)
