"""How much one client may ask: buckets that fill with time. Bounded, however many clients there are."""

from __future__ import annotations

from collections.abc import Callable

BUCKETS_MAX = 4096  # clients that are counted at once; full buckets are forgotten first


class Limiter:
    """Lets ``rate`` pass a second for each key, and ``burst`` at once after a pause."""

    def __init__(self, rate: float, burst: float, now: Callable[[], float]) -> None:
        self._rate, self._burst, self._now = rate, burst, now
        self._buckets: dict[str, tuple[float, float]] = {}  # what is left, and when it was

    def take(self, key: str) -> bool:
        """Take one; whether there was one."""
        now = self._now()
        bucket = self._buckets.get(key)
        if bucket is None:
            left = self._burst
            if len(self._buckets) >= BUCKETS_MAX:
                self._forget(now)
        else:
            left = bucket[0] + (now - bucket[1]) * self._rate
            if left > self._burst:
                left = self._burst
        taken = left >= 1.0
        self._buckets[key] = (left - 1.0 if taken else left, now)
        return taken

    def has(self, key: str) -> bool:
        """Whether there is one, without taking it."""
        left, at = self._buckets.get(key, (self._burst, 0.0))
        return left + (self._now() - at) * self._rate >= 1.0

    def _forget(self, now: float) -> None:
        """Those whose bucket is full again; if there are none, the first that came."""
        for key, (left, at) in list(self._buckets.items()):
            if left + (now - at) * self._rate >= self._burst:
                del self._buckets[key]
        if len(self._buckets) >= BUCKETS_MAX:
            del self._buckets[next(iter(self._buckets))]
