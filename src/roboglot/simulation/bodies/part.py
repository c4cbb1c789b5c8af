"""Declaration of a file of ``simulation/components``: a kind of part, its fitting to a robot, and its schedule.

Each such file ends with ``PART = Part(...)``. Bodies may then have its section, and robots fit and run it; no other
file needs a change (docs/components.md).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import field
from functools import cache
from graphlib import CycleError, TopologicalSorter
from importlib import import_module
from pkgutil import walk_packages
from typing import TYPE_CHECKING, Any, Generic, TypeVar

import numpy as np
from msgspec import Struct

from roboglot.model.components.component import Component
from roboglot.model.robot import Robot
from roboglot.simulation.bodies.body import Body
from roboglot.simulation.bodies.hull import Hull
from roboglot.simulation.bodies.schedule import Duty
from roboglot.simulation.bodies.tables import BatchedControl, BatchedSense, Control, RobotTables, Sense
from roboglot.values import dataclass

if TYPE_CHECKING:
    from roboglot.simulation.world.environment import Environment

P = TypeVar("P")


@dataclass(frozen=True, slots=True)
class Fitting:
    """Objects that the parts of one robot may use at fitting. ``tick``: period of control and sensors, s."""

    robot: Robot
    hull: Hull
    world: Environment
    tick: float
    fitted: dict[type[Any], Any] = field(default_factory=dict)

    @property
    def body(self) -> Body:
        """The robot's description."""
        return self.hull.body

    def chance(self, purpose: str) -> np.random.Generator:
        """Return this robot's own stream of random numbers for ``purpose``."""
        return self.world.chances.of(self.robot.id, purpose)

    def find(self, kind: type[P]) -> P | None:
        """Return the part of this class that was fitted before (``Part.after``), if there is one."""
        return self.fitted.get(kind)

    def get(self, kind: type[P]) -> P:
        """Return the part of this class that was fitted before. Raises KeyError."""
        part: P = self.fitted[kind]
        return part


@dataclass(frozen=True, slots=True, kw_only=True)
class Part(Generic[P]):
    """A kind of simulated part. ``P`` is its class, which implements ``interface``.

    name: its section's key in a body file, and its name for others. ``section``: the section's type; a part without
        one is offered to every robot. ``needs``: sections that a body file with this one must have.
    fit: makes the part, or returns None where it makes no sense.
    after: parts that are fitted, and whose ``sense`` runs, before this one's.
    control: called before the physics of every tick with its length (s), after the control of ``control_after``.
    sense: called after the physics with the stamp and the time since the last call (s), every ``every`` ticks (or
        as many as this answers for the part), the first time in tick ``first`` (0: when ``every`` have passed).
    sense_all: makes of all robots' parts of this kind one function that does for all what ``sense`` does for one, in
        every tick, before all other parts sense; it gets all tables, and the parts with their own ``sense``. It changes
        only these parts.
    control_all: the same for ``control``, before that of all other parts.
    ahead: makes of all robots' parts of this kind one function that computes in advance, after all ``sense_all`` of a
        tick, what each part's own ``sense`` then uses. It gets the tick's number, and may be left out in ticks in which
        none of them senses.
    duty: answers whether the part has something to do; without one ``control`` and ``sense`` are always called.
    displaced: called when the robot was lifted and put elsewhere. ``detach``: called when the world ends.
    """

    name: str
    fit: Callable[[Fitting], P | None]
    interface: type[Component] | None = None
    section: type[Struct] | None = None
    needs: tuple[str, ...] = ()
    after: tuple[str, ...] = ()
    control: Callable[[P, float], None] | None = None
    control_after: tuple[str, ...] = ()
    sense: Callable[[P, float, float], None] | None = None
    sense_all: Callable[[RobotTables, Sequence[tuple[P, Sense]]], BatchedSense] | None = None
    control_all: Callable[[RobotTables, Sequence[tuple[P, Control]]], BatchedControl] | None = None
    ahead: Callable[[RobotTables, Sequence[P]], Callable[[int], None]] | None = None
    every: int | Callable[[P], int] = 1
    first: int = 1
    duty: Callable[[P], Duty] | None = None
    displaced: Callable[[P], None] | None = None
    detach: Callable[[P], None] | None = None


@cache
def parts() -> tuple[Part[Any], ...]:
    """Return all parts, each after the parts in its ``after``."""
    package = import_module("roboglot.simulation.components")
    modules = (import_module(info.name) for info in walk_packages(package.__path__, f"{package.__name__}."))
    found = {part.name: part for module in modules if (part := getattr(module, "PART", None)) is not None}
    return tuple(ordered(found.values(), lambda part: part.after))


def ordered(among: Iterable[Part[object]], before: Callable[[Part[object]], tuple[str, ...]]) -> list[Part[object]]:
    """Sort parts so that each follows those it names, otherwise in their order. Raises ValueError for a circle."""
    named = {part.name: part for part in among}
    rank = {name: index for index, name in enumerate(named)}
    sorter = TopologicalSorter({name: [n for n in before(part) if n in named] for name, part in named.items()})
    try:
        sorter.prepare()
    except CycleError as error:
        raise ValueError(f"parts wait for each other: {', '.join(error.args[1])}") from None
    result: list[Part[object]] = []
    ready: list[str] = []
    while sorter.is_active():
        ready = sorted([*ready, *sorter.get_ready()], key=rank.__getitem__)
        name, *ready = ready
        result.append(named[name])
        sorter.done(name)
    return result
