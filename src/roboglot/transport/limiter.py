"""Rate limits of clients: buckets that fill with time. Memory is bounded for any number of clients."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

PAUSE_MAX = 5.0  # s
BUCKETS_MAX = 4096  # clients tracked at the same time; full buckets are dropped first


class Limiter:
    """Token buckets by key: ``rate`` tokens a second, at most ``burst`` at once after a pause."""

    def __init__(self, rate: float, burst: float, now: Callable[[], float]) -> None:
        self._rate, self._burst, self._now = rate, burst, now
        self._buckets: dict[str, tuple[float, float]] = {}  # the remaining amount, and its time

    def take(self, key: str) -> bool:
        """Take one token; return False if there is none."""
        now = self._now()
        bucket = self._buckets.get(key)
        left = self._left(key, now) if bucket is None else bucket[0] + (now - bucket[1]) * self._rate
        if left > self._burst:
            left = self._burst
        taken = left >= 1.0
        self._buckets[key] = (left - 1.0 if taken else left, now)
        return taken

    def has(self, key: str) -> bool:
        """Return whether ``take`` would succeed now."""
        return self._left(key, self._now()) >= 1.0

    def spend(self, key: str, amount: float) -> float:
        """Take ``amount`` in any case; return the seconds until the debt is paid, 0 without debt."""
        now = self._now()
        left = self._left(key, now) - amount
        self._buckets[key] = (left, now)
        return 0.0 if left >= 0.0 else -left / self._rate

    def give_back(self, key: str) -> None:
        """Undo one ``take``."""
        if (bucket := self._buckets.get(key)) is not None:
            self._buckets[key] = (min(self._burst, bucket[0] + 1.0), bucket[1])

    def _left(self, key: str, now: float) -> float:
        bucket = self._buckets.get(key)
        if bucket is None:
            if len(self._buckets) >= BUCKETS_MAX:
                self._forget(now)
            return self._burst
        left = bucket[0] + (now - bucket[1]) * self._rate
        return left if left < self._burst else self._burst

    def _forget(self, now: float) -> None:
        """Drop all full buckets; if there are none, the oldest one."""
        for key, (left, at) in list(self._buckets.items()):
            if left + (now - at) * self._rate >= self._burst:
                del self._buckets[key]
        if len(self._buckets) >= BUCKETS_MAX:
            del self._buckets[next(iter(self._buckets))]


async def pay(debt: float) -> None:
    """Wait for ``debt`` s (from ``Limiter.spend``) of the machine's time, at most ``PAUSE_MAX``."""
    if debt > 0.0:
        await asyncio.sleep(min(debt, PAUSE_MAX))
