"""Pulse-width modulated outputs for devices that users attach."""

from __future__ import annotations

from abc import abstractmethod

from roboglot.model.components.component import Component
from roboglot.values import dataclass

FREQUENCY_MAX = 50_000.0  # Hz


@dataclass(frozen=True, slots=True)
class PwmSignal:
    """Share of the period that the output is high (0..1), and periods per second (Hz)."""

    duty: float
    frequency: float


class PwmPorts(Component):
    """Numbered from 1. An unknown number raises NotFound, a value out of range InvalidGoal."""

    count: int

    @abstractmethod
    def signal(self, port: int) -> PwmSignal:
        """Return the output signal of a port."""

    @abstractmethod
    def set_duty(self, port: int, duty: float) -> None:
        """Set the duty cycle (0..1) of a port."""

    @abstractmethod
    def set_frequency(self, port: int, frequency: float) -> None:
        """Set the frequency (Hz, above 0) of a port."""

    @abstractmethod
    def reset(self) -> None:
        """Reset all outputs to their state at power-on."""
