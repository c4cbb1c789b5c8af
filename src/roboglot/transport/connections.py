"""Limits on the connections of a port, in total and per host."""

from __future__ import annotations

from collections import Counter


class Connections:
    """Connections of one port: at most ``most`` at once, and half of these from one host."""

    def __init__(self, most: int) -> None:
        self._most = most
        self._hosts: Counter[str] = Counter()

    @property
    def count(self) -> int:
        """Number of open connections."""
        return self._hosts.total()

    def of(self, host: str) -> int:
        """Return the number of connections of this host."""
        return self._hosts[host]

    def enter(self, host: str, share: int) -> bool:
        """Count a new connection if ``host`` has fewer than ``share`` and the port has room; return True if so."""
        if self._hosts[host] >= min(share, max(1, self._most // 2)) or self.count >= self._most:
            return False
        self._hosts[host] += 1
        return True

    def leave(self, host: str) -> None:
        """Count a closed connection of ``host``."""
        self._hosts[host] -= 1
        if self._hosts[host] <= 0:
            del self._hosts[host]
