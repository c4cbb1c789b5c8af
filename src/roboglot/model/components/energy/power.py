"""Power modes: awake, low power, asleep, off."""

from __future__ import annotations

from abc import abstractmethod
from enum import StrEnum

from roboglot.model.actions import Action
from roboglot.model.components.component import Component
from roboglot.model.errors import InvalidGoal

POWER = "power"  # the resource that changes of the power mode hold


DAYS_MAX = 30  # to the end, and to a new start


def check_delays(after: float, restart_after: float | None) -> None:
    """Raise InvalidGoal for seconds of ``shut_down`` below 0 or above DAYS_MAX."""
    if not all(0.0 <= seconds <= DAYS_MAX * 86_400.0 for seconds in (after, restart_after or 0.0)):
        raise InvalidGoal(f"the time must be 0 to {DAYS_MAX} days ahead")


class PowerMode(StrEnum):
    """Power mode of the robot, from awake to off."""

    AWAKE = "awake"
    WAKING_UP = "waking up"
    LOW_POWER = "low power"  # lying, motors off, still responding
    ASLEEP = "asleep"  # with the sensors off as well
    OFF = "off"


class Power(Component):
    """Every change publishes ``PowerModeChanged``. A robot that is not awake refuses to move."""

    @property
    @abstractmethod
    def mode(self) -> PowerMode:
        """Current state."""

    @property
    def rests(self) -> tuple[PowerMode, ...]:
        """Modes that ``save`` and ``sleep`` can bring this robot to, the lighter one first."""
        return (PowerMode.LOW_POWER, PowerMode.ASLEEP)

    @property
    @abstractmethod
    def automatic(self) -> bool:
        """True if a robot that lies for half a minute goes to low power by itself."""

    @abstractmethod
    async def set_automatic(self, on: bool) -> None:
        """Switch ``automatic`` on or off; returns once the setting is on disk."""

    @abstractmethod
    def save(self, *, source: str = "") -> Action:
        """Lie down and go to LOW_POWER. Aborts with Refused unless awake."""

    @abstractmethod
    def sleep(self, *, source: str = "") -> Action:
        """Lie down and sleep. Aborts with Refused when off."""

    @abstractmethod
    def wake(self, *, source: str = "") -> Action:
        """Return to AWAKE, lying; succeeds at once if awake. Aborts with Refused when off or the battery is empty."""

    @abstractmethod
    def shut_down(self, *, source: str = "", after: float = 0.0, restart_after: float | None = None) -> Action:
        """Go OFF in ``after`` s (publishes ``ShuttingDown``), and start again ``restart_after`` s later if given."""
