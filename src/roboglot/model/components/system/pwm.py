"""Pulse-width modulated outputs for things that users attach."""

from __future__ import annotations

from abc import abstractmethod
from dataclasses import dataclass

from roboglot.model.components.component import Component

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
        """Return what it puts out."""

    @abstractmethod
    def set_duty(self, port: int, duty: float) -> None:
        """Put out this share (0..1) from now on."""

    @abstractmethod
    def set_frequency(self, port: int, frequency: float) -> None:
        """Pulse at this rate (Hz, above 0) from now on."""

    @abstractmethod
    def reset(self) -> None:
        """All outputs as at power-on."""
