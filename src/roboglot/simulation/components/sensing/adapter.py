"""Sensor adapters whose input voltages are set by tests and users."""

from __future__ import annotations

from msgspec import Struct

from roboglot.model.clock import Clock
from roboglot.model.components.sensing.adapter import SensorAdapters
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.model.events import AdapterLevelChanged, EventStream
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Count, Positive
from roboglot.values import dataclass


class SensorAdaptersSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Number of adapters, and of ports per adapter; full scale, and threshold of the high level, V."""

    count: Count
    ports: Count
    voltage_max: Positive
    threshold: Positive


@dataclass(slots=True)
class _Input:
    """Voltage (V), time of the last level change (s); ``period``: between the last two changes, s."""

    voltage: float = 0.0
    changed_at: float | None = None
    period: float = 0.0


class SimulatedSensorAdapters(SensorAdapters):
    """Adapters whose open inputs are at 0 V."""

    def __init__(self, section: SensorAdaptersSection, clock: Clock, events: EventStream) -> None:
        self.count, self.ports, self.voltage_max = section.count, section.ports, section.voltage_max
        self._threshold, self._clock, self._events = section.threshold, clock, events
        self._inputs = [[_Input() for _ in range(section.ports)] for _ in range(section.count)]

    def voltage(self, adapter: int, port: int) -> float:
        return self._input(adapter, port).voltage

    def level(self, adapter: int, port: int) -> bool:
        return self._input(adapter, port).voltage >= self._threshold

    def pulse_period(self, adapter: int, port: int) -> float:
        return self._input(adapter, port).period

    def apply(self, adapter: int, port: int, voltage: float) -> None:
        """Set the voltage of an input, V. Raises NotFound; InvalidGoal outside 0 to full scale."""
        there = self._input(adapter, port)
        if not 0.0 <= voltage <= self.voltage_max:
            raise InvalidGoal(f"an input takes 0 to {self.voltage_max:g} V, not {voltage}")
        before = self.level(adapter, port)
        there.voltage = voltage
        level = self.level(adapter, port)
        if level == before:
            return
        now = self._clock.time()
        if there.changed_at is not None:
            there.period = now - there.changed_at
        there.changed_at = now
        self._events.publish(AdapterLevelChanged(stamp=now, adapter=adapter, port=port, level=level))

    def _input(self, adapter: int, port: int) -> _Input:
        if not (1 <= adapter <= self.count and 1 <= port <= self.ports):
            raise NotFound(f"there is no port {port} on sensor adapter {adapter}")
        return self._inputs[adapter - 1][port - 1]


def _fit(fit: Fitting) -> SimulatedSensorAdapters:
    return SimulatedSensorAdapters(fit.body[SensorAdaptersSection], fit.robot.clock, fit.robot.events)


PART = Part(name="sensor_adapters", interface=SensorAdapters, section=SensorAdaptersSection, fit=_fit)
