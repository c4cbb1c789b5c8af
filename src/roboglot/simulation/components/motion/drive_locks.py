"""Locks on a base, which refuses to drive while there is any."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.errors import Refused
from roboglot.model.robot import Robot


class DriveLocks:
    """Locks by holder; refusals give the reason of the first. ``brake`` is called at each new lock."""

    def __init__(self, brake: Callable[[], None]) -> None:
        self._brake = brake
        self._locks: dict[str, Refused] = {}

    def lock(self, who: str, reason: str | Refused) -> None:
        """Brake, and refuse to drive until ``who`` unlocks; ``reason``: a text, or the error to raise."""
        self._locks[who] = reason if isinstance(reason, Refused) else Refused(reason)
        self._brake()

    def unlock(self, who: str) -> None:
        """Remove the lock of ``who``, if there is one."""
        self._locks.pop(who, None)

    def held_by(self, who: str) -> bool:
        """True if ``who`` has a lock."""
        return who in self._locks

    @property
    def held(self) -> bool:
        """True if there is any lock."""
        return bool(self._locks)

    def first(self, *, but: str) -> Refused | None:
        """Return the error of the first lock of a holder other than ``but``; None: there is none."""
        return next((reason for who, reason in self._locks.items() if who != but), None)

    def check(self) -> None:
        """Raise the first lock's Refused, if there is a lock."""
        if self._locks:
            raise next(iter(self._locks.values()))


def hold_still(robot: Robot, locks: DriveLocks, who: str, reason: str | Refused) -> None:
    """Stop wheels and all other actuators, and refuse to move them until ``let_move``."""
    locks.lock(who, reason)
    robot.actuators.hold(who, reason)


def let_move(robot: Robot, locks: DriveLocks, who: str) -> None:
    """End what ``who`` held still."""
    locks.unlock(who)
    robot.actuators.release(who)
