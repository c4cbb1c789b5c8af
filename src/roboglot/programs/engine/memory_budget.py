"""One memory budget for all programs: the kernel limits each program, this module their sum.

Times are in the machine's time.
"""

from __future__ import annotations

import asyncio
import logging
from collections.abc import Callable, Collection
from typing import Protocol

from roboglot.programs.engine.events import ExitReason
from roboglot.programs.engine.usage import machine_memory, usage_of

log = logging.getLogger(__name__)

LOOK_EVERY = 0.25
"""Period of checks, s; meanwhile all programs together can take some hundred megabytes."""
TOGETHER = 2 * 1024**3
"""Default budget in bytes; half of the machine's memory if that is less."""


class BudgetedRun(Protocol):
    """A run that may be ended to free memory."""

    @property
    def pid(self) -> int:
        """Process id."""

    def end(self, reason: ExitReason, kind: str, message: str) -> None:
        """End the run for this reason."""


class MemoryBudget:
    """Checks ``runs`` as long as there are any, and ends the largest while their sum is above the budget.

    ``total``: bytes, 0 for the default. ``empty``: memory of an empty program, shared by all, bytes.
    """

    def __init__(
        self, runs: Collection[BudgetedRun], total: int = 0, usage: Callable[[int], int] | None = None
    ) -> None:
        self.total = total or min(TOGETHER, machine_memory() // 2)
        self.empty = 0
        self._runs = runs
        self._usage = usage or (lambda pid: usage_of(pid).memory)
        self._watching: asyncio.Task[None] | None = None

    def watch(self) -> None:
        """Start checking, until no run is left."""
        if self._watching is None or self._watching.done():
            self._watching = asyncio.get_running_loop().create_task(self._watch(), name="memory of programs")

    async def close(self) -> None:
        """Stop checking."""
        if self._watching is not None:
            self._watching.cancel()
            await asyncio.gather(self._watching, return_exceptions=True)

    async def _watch(self) -> None:
        while self._runs:
            runs = tuple(self._runs)
            sizes = await asyncio.to_thread(lambda: [max(0, self._usage(run.pid) - self.empty) for run in runs])  # noqa: B023
            self._end_largest(sorted(zip(sizes, runs, strict=True), key=lambda pair: pair[0]))
            await self._pause()

    def _end_largest(self, by_size: list[tuple[int, BudgetedRun]]) -> None:
        held = sum(size for size, _ in by_size)
        while held > self.total:
            size, run = by_size.pop()
            held -= size
            limit = self.total // 1024**2
            log.warning(
                "programs together use more than %d MiB: ending the largest one, %d MiB", limit, size // 1024**2
            )
            words = f"all programs together used more than {limit} MiB, this one most of it"
            run.end(ExitReason.MEMORY, "MemoryError", words)

    async def _pause(self) -> None:
        over: asyncio.Future[None] = asyncio.get_running_loop().create_future()
        timer = asyncio.get_running_loop().call_later(
            LOOK_EVERY, lambda: None if over.done() else over.set_result(None)
        )
        try:
            await over
        finally:
            timer.cancel()
