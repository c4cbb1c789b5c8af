"""All people of a world, tick by tick; those who only walk or wait by one kernel. Knows no physics but its arrays."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Protocol

import numpy as np

from roboglot.kernels import loading
from roboglot.kernels.arrays import FloatArray
from roboglot.kernels.layouts import PERSON_STATE, PERSON_WIDTH, STANDS
from roboglot.model.geometry import Pose
from roboglot.simulation.people.people import MANNERS, NEAR, SIDE, Free, Walker
from roboglot.simulation.people.person_state import blank
from roboglot.simulation.people.routine import Clap, Say

Sound = Callable[[Walker, Say | Clap], None]
HABITS = MANNERS, SIDE, NEAR  # as the kernel takes them


class Floor(Protocol):
    """The physics that people need.

    ``people``: places of all who may be there among its movable bodies, by name. ``around_people``: table of the hulls;
    places and turns of the movable bodies.
    """

    people: dict[str, int]
    around_people: tuple[FloatArray, FloatArray, FloatArray]

    def spots(self) -> dict[int, list[tuple[float, float]]]: ...

    def move_person(self, body: str, pose: Pose, floor: int) -> None: ...

    def remove_person(self, body: str) -> None: ...


class Crowd:
    """People in their rows of ``table``. ``walkers``: those who are there, shared by everything that observes them."""

    def __init__(self, walkers: list[Walker], physics: Floor) -> None:
        self.walkers, self._physics = walkers, physics
        self._rows = {body: row for row, body in enumerate(physics.people)}
        self.table = np.zeros((len(self._rows), PERSON_WIDTH))
        self._in: dict[int, Walker] = {}  # by row
        self._free: Free = lambda _walker, _spot: True
        self._sound: Sound = lambda _walker, _step: None
        self._walk: Callable[..., int] | None = None
        for walker in walkers:
            self._seat(walker)
            physics.move_person(walker.body, walker.pose, walker.floor)

    def meet(self, free: Free, sound: Sound) -> None:
        """Use these from now on: ``free`` finds ways past others, ``sound`` plays people's speech and claps."""
        self._free, self._sound = free, sound

    def load_kernels(self) -> None:
        """Use the compiled kernel where possible from now on; all paths stay the same."""
        with loading():
            from roboglot.kernels import ticks

        self._walk = ticks.walk

    def join(self, walker: Walker) -> None:
        """Add a person."""
        self.walkers.append(walker)
        self._seat(walker)
        self._physics.move_person(walker.body, walker.pose, walker.floor)

    def leave(self, walker: Walker) -> None:
        """Take a person away."""
        self.walkers.remove(walker)
        row = self._rows[walker.body]
        del self._in[row]
        walker.enter(blank(), -1)
        self.table[row, PERSON_STATE] = STANDS
        self._physics.remove_person(walker.body)

    def _seat(self, walker: Walker) -> None:
        row = self._rows[walker.body]
        numbers: memoryview[float] = memoryview(self.table[row]).cast("B").cast("d")
        walker.enter(numbers, self._physics.people[walker.body])
        self._in[row] = walker

    def walk(self, seconds: float, first: int = -1) -> None:
        """Let ``seconds`` pass for all; from row ``first`` on, if the kernel has stopped there."""
        spots: Mapping[int, Sequence[tuple[float, float]]] | None = None
        row = first if first >= 0 else self._next(0, seconds)
        while row < len(self.table):
            if (walker := self._in.get(row)) is not None:
                spots = self._physics.spots() if spots is None else spots
                if walker.walk(seconds, spots.get(walker.floor, ()), self._free):
                    self._physics.move_person(walker.body, walker.pose, walker.floor)
                for step in walker.fetch() if walker.aloud else ():
                    self._sound(walker, step)
            row = self._next(row + 1, seconds)

    def _next(self, row: int, seconds: float) -> int:
        """Return the next row, from this one on, that the kernel does not do."""
        if self._walk is None:
            return row
        return self._walk(self.table, *self._physics.around_people, row, seconds, *HABITS)
