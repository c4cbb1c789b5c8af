"""Fits a robot with the parts of its body's description, and runs them in order."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from types import MethodType
from typing import TypeVar

from roboglot.model.client_context import context_of
from roboglot.simulation.bodies.part import Fitting, Part, ordered, parts
from roboglot.simulation.bodies.schedule import Job, Schedule
from roboglot.simulation.bodies.tables import Control, Sense

P = TypeVar("P")


class SimulatedRobot:
    """The simulated parts of one robot, run by the world in ticks in which some are due: control, physics, sensing.

    ``controls`` and ``senses``: their schedules; ``before``: tick of the world before the robot's first one.

    Parts with a longer period begin ``turn`` ticks later, within their period: otherwise the scans of many robots would
    all come in one tick, and delay their clients.
    """

    def __init__(self, fitting: Fitting, turn: int = 0) -> None:
        self._fitting = fitting
        self.before: int | None = None
        self._context = context_of(fitting.robot.id)
        fitted: list[tuple[Part[object], object]] = []
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
        alone = (part for part, _ in fitted if part.control and part.control_all is None)
        controlled = ordered(alone, lambda part: part.control_after)
        tick = fitting.tick
        self.controls = Schedule([_job(part, made[part.name], part.control) for part in controlled], tick)
        sensed = [
            _periodic(part, component, turn) for part, component in fitted if part.sense and part.sense_all is None
        ]
        self.senses = Schedule(sensed, tick)
        self._batched_senses = {
            part.name: (component, MethodType(part.sense, component))
            for part, component in fitted
            if part.sense_all is not None and part.sense is not None
        }
        self._ahead = {part.name: component for part, component in fitted if part.ahead is not None}
        self._batched_controls = {
            part.name: (component, MethodType(part.control, component))
            for part, component in fitted
            if part.control_all is not None and part.control is not None
        }
        self._displaced = [MethodType(part.displaced, component) for part, component in fitted if part.displaced]
        self._detach = [MethodType(part.detach, component) for part, component in fitted if part.detach]

    def find(self, kind: type[P]) -> P | None:
        """Return the part of this class, if the body has one."""
        return self._fitting.find(kind)

    def control(self, tick: int) -> None:
        """Run the parts' control that is due, before the physics of a tick."""
        self._context.run(self.controls.run, tick - (self.before or 0))

    def sense(self, tick: int, stamp: float) -> None:
        """Run the sensing that is due, without that of ``sense_all``, after the physics of a tick."""
        self._context.run(self.senses.run_at, tick - (self.before or 0), stamp)

    def batched_sense(self, name: str) -> tuple[object, Sense] | None:
        """Return the part of this name with its sensing, to be sensed for all robots at once; None: there is none."""
        return self._batched_senses.get(name)

    def batched_control(self, name: str) -> tuple[object, Control] | None:
        """Return the part of this name with its control, to be controlled for all robots at once, or None."""
        return self._batched_controls.get(name)

    def ahead(self, name: str) -> object | None:
        """Return the part of this name, if it is computed ahead for all robots."""
        return self._ahead.get(name)

    def displaced(self) -> None:
        """Notify the parts that the robot was lifted and put elsewhere."""
        for displaced in self._displaced:
            displaced()

    def detach(self) -> None:
        """Let the parts end their background tasks."""
        for detach in self._detach:
            detach()


def _job(part: Part[object], component: object, method: Callable[..., None] | None) -> Job:
    assert method is not None
    return Job(MethodType(method, component), duty=part.duty(component) if part.duty is not None else None)


def _periodic(part: Part[object], component: object, turn: int) -> Job:
    every = part.every if isinstance(part.every, int) else part.every(component)
    job = _job(part, component, part.sense)
    return replace(job, every=every, first=(part.first or every) + turn % every)
