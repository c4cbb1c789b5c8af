"""Limits on the connections of a port, in all and from one host."""

from __future__ import annotations

from collections import Counter


class Connections:
    """Connections of one port: ``most`` at once, and no host has more than half of them."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._hosts: Counter[str] = Counter()

    @property
    def count(self) -> int:
        """Number of open connections."""
        return self._hosts.total()

    def of(self, host: str) -> int:
        """Return how many of them are this host's."""
        return self._hosts[host]

    def enter(self, host: str, share: int) -> bool:
        """Count one more in, if ``host`` has fewer than ``share`` and there is room."""
        if self._hosts[host] >= min(share, max(1, self._most // 2)) or self.count >= self._most:
            return False
        self._hosts[host] += 1
        return True

    def leave(self, host: str) -> None:
        """One is gone."""
        self._hosts[host] -= 1
        if self._hosts[host] <= 0:
            del self._hosts[host]
