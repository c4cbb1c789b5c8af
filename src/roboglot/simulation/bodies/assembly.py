"""Fits a robot with the parts that its body describes, and runs them in order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from types import MethodType
from typing import Any, TypeVar

from roboglot.model.client_context import context_of
from roboglot.simulation.bodies.part import Fitting, Part, ordered, parts

P = TypeVar("P")
Sense = Callable[[float, float], None]


class SimulatedRobot:
    """The simulated parts of one robot, run by the world once a tick: ``control``, physics, ``sense``."""

    def __init__(self, fitting: Fitting) -> None:
        self._fitting = fitting
        self._context = context_of(fitting.robot.id)
        fitted: list[tuple[Part[Any], Any]] = []
        for part in parts():
            if part.section is not None and fitting.body.get(part.section) is None:
                continue
            component = part.fit(fitting)
            if component is None:
                continue
            fitting.fitted[type(component)] = component
            if part.interface is not None:
                fitting.robot.add(part.interface, component)
            fitted.append((part, component))
        made = {part.name: component for part, component in fitted}
        controlled = ordered((part for part, _ in fitted if part.control), lambda part: part.control_after)
        self._controls = [MethodType(part.control, made[part.name]) for part in controlled if part.control]
        self._senses = [_sense_of(part, component) for part, component in fitted if part.sense]
        self._displaced = [MethodType(part.displaced, component) for part, component in fitted if part.displaced]
        self._detach = [MethodType(part.detach, component) for part, component in fitted if part.detach]

    def find(self, kind: type[P]) -> P | None:
        """Return the part of this class, if the body has one."""
        return self._fitting.find(kind)

    def control(self, seconds: float) -> None:
        """Run before the physics of a tick."""
        self._context.run(self._run_all, self._controls, seconds)

    def sense(self, stamp: float, seconds: float) -> None:
        """Run after it."""
        self._context.run(self._run_all, self._senses, stamp, seconds)

    @staticmethod
    def _run_all(parts: Sequence[Callable[..., None]], *times: float) -> None:
        for part in parts:
            part(*times)

    def displaced(self) -> None:
        """Notify the parts that the robot was lifted and put elsewhere."""
        for displaced in self._displaced:
            displaced()

    def detach(self) -> None:
        """Let the parts end what they do beside the world's time."""
        for detach in self._detach:
            detach()


def _sense_of(part: Part[Any], component: Any) -> Sense:
    sense: Sense = MethodType(part.sense, component) if part.sense else _nothing
    return sense if part.every == 1 else Periodic(sense, part.every, part.first)


def _nothing(stamp: float, seconds: float) -> None:
    pass


class Periodic:
    """Runs a ``sense`` once in so many ticks, with the time since the last run."""

    def __init__(self, sense: Sense, every: int, first: int) -> None:
        self._sense, self._every, self._left = sense, every, first
        self._since = 0.0

    def __call__(self, stamp: float, seconds: float) -> None:
        self._since += seconds
        self._left -= 1
        if not self._left:
            self._left = self._every
            seconds, self._since = self._since, 0.0
            self._sense(stamp, seconds)
