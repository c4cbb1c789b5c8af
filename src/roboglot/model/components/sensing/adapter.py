"""Sensor adapters: inputs for sensors that users attach."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component


class SensorAdapters(Component):
    """Numbered from 1, each with ports from 1; unknown ones raise NotFound. Publishes ``AdapterLevelChanged``."""

    count: int
    ports: int
    voltage_max: float  # V, full scale

    @abstractmethod
    def voltage(self, adapter: int, port: int) -> float:
        """Return the voltage at the input, V."""

    @abstractmethod
    def level(self, adapter: int, port: int) -> bool:
        """Return whether the input is logically high."""

    @abstractmethod
    def pulse_period(self, adapter: int, port: int) -> float:
        """Return the seconds between the last two changes of the level; 0 before the second."""
