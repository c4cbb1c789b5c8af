"""PWM outputs: registers only, with nothing connected."""

from __future__ import annotations

from typing import Annotated

from msgspec import Meta, Struct

from roboglot.model.components.system.pwm import FREQUENCY_MAX, PwmPorts, PwmSignal
from roboglot.model.errors import InvalidGoal, NotFound
from roboglot.simulation.bodies.part import Fitting, Part
from roboglot.simulation.bodies.quantities import Count, Positive


class PwmPortsSection(Struct, frozen=True, forbid_unknown_fields=True):
    """Number of ports; duty (0..1) and frequency (Hz) at power-on."""

    count: Count
    duty: Annotated[float, Meta(ge=0, le=1)]
    frequency: Positive


class SimulatedPwmPorts(PwmPorts):
    """PWM ports, all with the same signal at power-on."""

    def __init__(self, section: PwmPortsSection) -> None:
        self.count = section.count
        self._section = section
        self.reset()

    def signal(self, port: int) -> PwmSignal:
        if not 1 <= port <= self.count:
            raise NotFound(f"there is no PWM port {port}")
        return self._signals[port - 1]

    def set_duty(self, port: int, duty: float) -> None:
        now = self.signal(port)
        if not 0.0 <= duty <= 1.0:
            raise InvalidGoal(f"a duty is 0 to 1, not {duty}")
        self._signals[port - 1] = PwmSignal(duty, now.frequency)

    def set_frequency(self, port: int, frequency: float) -> None:
        now = self.signal(port)
        if not 0.0 < frequency <= FREQUENCY_MAX:
            raise InvalidGoal(f"a frequency must be above 0 and at most {FREQUENCY_MAX:g} Hz, not {frequency}")
        self._signals[port - 1] = PwmSignal(now.duty, frequency)

    def reset(self) -> None:
        self._signals = [PwmSignal(self._section.duty, self._section.frequency)] * self.count


def _fit(fit: Fitting) -> SimulatedPwmPorts:
    return SimulatedPwmPorts(fit.body[PwmPortsSection])


PART = Part(name="pwm_ports", interface=PwmPorts, section=PwmPortsSection, fit=_fit)
