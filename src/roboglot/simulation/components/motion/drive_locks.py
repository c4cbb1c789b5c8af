"""Locks on a base: while anyone has one, it refuses to drive."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.errors import Refused


class DriveLocks:
    """The first lock gives the reason of every refusal. ``brake`` is called with each new one."""

    def __init__(self, brake: Callable[[], None]) -> None:
        self._brake = brake
        self._locks: dict[str, Refused] = {}

    def lock(self, who: str, reason: str | Refused) -> None:
        """Brake, and refuse to drive until ``who`` unlocks it again; ``reason`` is why, or the error to refuse with."""
        self._locks[who] = reason if isinstance(reason, Refused) else Refused(reason)
        self._brake()

    def unlock(self, who: str) -> None:
        """Withdraw the objection of ``who``; do nothing if there was none."""
        self._locks.pop(who, None)

    def held_by(self, who: str) -> bool:
        """True if ``who`` objects to driving."""
        return who in self._locks

    @property
    def held(self) -> bool:
        """True if anyone does."""
        return bool(self._locks)

    def first(self, *, but: str) -> Refused | None:
        """Return the error of the first lock that is not that of ``but``."""
        return next((reason for who, reason in self._locks.items() if who != but), None)

    def check(self) -> None:
        """Raise Refused if anyone objects."""
        if self._locks:
            raise next(iter(self._locks.values()))
