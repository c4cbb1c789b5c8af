"""The robot's current faults. Components set them, doors read them."""

from __future__ import annotations

from collections.abc import Callable

from roboglot.model.clock import Clock
from roboglot.model.components.component import Component
from roboglot.model.components.system.fault import Fault, FaultLevel
from roboglot.model.errors import NotFound
from roboglot.model.events import EventStream, FaultCleared, FaultRaised

__all__ = ["FAULTS_MAX", "MOTOR_ALARM", "REMINDER", "Fault", "FaultLevel", "Health"]

MOTOR_ALARM = "motor alarm"  # the fault of a motor that does not turn
REMINDER = 10.0  # s after which a dismissed fault comes back if its cause persists
FAULTS_MAX = 100


class Health(Component):
    """Collects faults by name; publishes ``FaultRaised`` and ``FaultCleared``."""

    def __init__(self, clock: Clock, events: EventStream) -> None:
        self._clock, self._events = clock, events
        self._faults: dict[str, Fault] = {}
        self._dismissed: dict[str, Callable[[], None]] = {}
        self._last_id = 0

    @property
    def faults(self) -> list[Fault]:
        """Faults that were not dismissed, oldest first."""
        return [fault for name, fault in self._faults.items() if name not in self._dismissed]

    def has(self, name: str) -> bool:
        """Return whether this fault is present, dismissed or not."""
        return name in self._faults

    @property
    def worst(self) -> FaultLevel | None:
        """Highest level of the faults; None without faults."""
        return max((fault.level for fault in self.faults), default=None)

    def set(self, name: str, present: bool, component: str, level: FaultLevel, message: str = "") -> None:
        """Raise or clear a fault; called by components. Cheap when nothing changed."""
        if present == (name in self._faults):
            return
        if not present:
            fault = self._faults.pop(name)
            if (forget := self._dismissed.pop(name, None)) is not None:
                forget()
            else:
                self._events.publish(FaultCleared(stamp=self._clock.time(), fault=fault))
        elif len(self._faults) < FAULTS_MAX:
            self._last_id += 1
            now = self._clock.time()
            self._faults[name] = Fault(self._last_id, name, component, level, message or name, now)
            self._events.publish(FaultRaised(stamp=now, fault=self._faults[name]))

    def dismiss(self, id: int) -> None:
        """Hide a fault; it is raised again after REMINDER if its cause persists. Raises NotFound."""
        fault = next((fault for fault in self.faults if fault.id == id), None)
        if fault is None:
            raise NotFound(f"there is no fault {id}")
        name = fault.name
        self._dismissed[name] = self._clock.call_later(REMINDER, lambda: self._raise_again(name)).cancel
        self._events.publish(FaultCleared(stamp=self._clock.time(), fault=fault))

    def _raise_again(self, name: str) -> None:
        del self._dismissed[name]
        self._events.publish(FaultRaised(stamp=self._clock.time(), fault=self._faults[name]))
