"""The touch pad, touched through the world's stage."""

from __future__ import annotations

from msgspec import Struct

from roboglot.model.components.sensing.touch import Touch, TouchKind
from roboglot.model.events import Touched
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.part import Fitting, Part


class TouchSection(Struct, frozen=True, forbid_unknown_fields=True):
    """A pad on the head."""


class SimulatedTouch(Touch):
    """Touch pad pressed by ``Stage.touch``."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._last: tuple[float, TouchKind] | None = None

    @property
    def last(self) -> tuple[float, TouchKind] | None:
        return self._last

    def touch(self, kind: TouchKind) -> None:
        """Touch the pad now."""
        now = self._robot.clock.time()
        self._last = now, kind
        self._robot.events.publish(Touched(stamp=now, kind=kind))


def _fit(fit: Fitting) -> SimulatedTouch:
    return SimulatedTouch(fit.robot)


PART = Part(name="touch", interface=Touch, section=TouchSection, fit=_fit)
