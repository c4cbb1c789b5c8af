"""Tables of numbers with a row for each robot of a world, so that one kernel computes a tick of all robots.

A part that is computed for all robots together (``Part.together``) keeps its state there, in its own row.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from roboglot.kernels import loading
from roboglot.kernels.arrays import FloatArray, IntArray
from roboglot.values import dataclass

Sense = Callable[[float, float], None]  # of stamp and time since the last call, s

Control = Callable[[float], None]  # of the length of a tick, s


@dataclass(frozen=True, slots=True)
class Kernels:
    """The compiled functions of ``kernels/together.py``."""

    still: Callable[..., bool]
    follow: Callable[..., int]
    drive: Callable[..., None]
    see: Callable[..., int]
    measure: Callable[..., int]
    watch: Callable[..., int]
    dead_reckon: Callable[..., int]
    touch: Callable[..., int]


@dataclass(frozen=True, slots=True)
class Leg:
    """Stage of a tick in ``kernels/ticks.py``, with the tables and numbers it takes; ``refresh`` updates the tables."""

    stage: int
    tables: tuple[FloatArray, ...]
    settings: tuple[float, ...] = ()
    refresh: Callable[[], None] | None = None


class Rows:
    """Tables for ``robots`` robots. ``kernels``: None until loaded; ``others``: buffer for rows that they leave."""

    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._tables: dict[str, FloatArray] = {}
        self.kernels: Kernels | None = None
        self.others: IntArray = np.zeros(robots, np.int64)

    def load_kernels(self) -> None:
        """Compute with the compiled kernels from now on; results stay the same, to the last bit."""
        with loading():
            from roboglot.kernels import together

        self.kernels = Kernels(
            together.still,
            together.follow,
            together.drive,
            together.see,
            together.measure,
            together.watch,
            together.dead_reckon,
            together.touch,
        )

    def table(self, name: str, width: int) -> FloatArray:
        """Return the table of this name, at first full of zeros; ``width``: numbers in a row."""
        if name not in self._tables:
            self._tables[name] = np.zeros((self._robots, width))
        return self._tables[name]

    def control(self, alone: Mapping[int, Control], kernel: Callable[[Kernels, float], int], leg: Leg) -> SharedControl:
        """Return control by ``kernel``, and by ``alone`` for rows that it leaves; see ``sense``."""
        return SharedControl(self, alone, kernel, leg)

    def sense(
        self, alone: Mapping[int, Sense], kernel: Callable[[Kernels, float, float], int], leg: Leg | None = None
    ) -> SharedSense:
        """Return sensing by one call of ``kernel``, and by ``alone`` (by row) for rows that it leaves.

        While there are no kernels, ``alone`` does all rows. The kernel returns the number of rows that it has left.
        ``leg``: the same stage in the kernel of whole ticks (``kernels/ticks.py``).
        """
        return SharedSense(self, alone, kernel, leg)


@dataclass(frozen=True, slots=True)
class Seat:
    """One robot's place in all tables."""

    rows: Rows
    index: int

    def row(self, name: str, width: int) -> memoryview[float]:
        """Return the robot's row of a table, set to zeros; single numbers are quicker to access than in an array."""
        self.rows.table(name, width)[self.index] = 0.0
        row: memoryview[float] = memoryview(self.rows.table(name, width)[self.index]).cast("B").cast("d")
        return row


@dataclass(frozen=True, slots=True)
class SharedControl:
    """Control of one kind of part of all robots, see ``Rows.control``."""

    rows: Rows
    alone: Mapping[int, Control]
    kernel: Callable[[Kernels, float], int]
    leg: Leg

    def __call__(self, seconds: float) -> None:
        """Control all."""
        rows = self.rows
        if rows.kernels is None:
            for one in self.alone.values():
                one(seconds)
        elif count := self.kernel(rows.kernels, seconds):
            for index in rows.others[:count].tolist():
                self.alone[index](seconds)


@dataclass(frozen=True, slots=True)
class SharedSense:
    """Sensing of one kind of part of all robots, see ``Rows.sense``."""

    rows: Rows
    alone: Mapping[int, Sense]
    kernel: Callable[[Kernels, float, float], int]
    leg: Leg | None

    def __call__(self, stamp: float, seconds: float) -> None:
        """Sense with all."""
        rows = self.rows
        if rows.kernels is None:
            for one in self.alone.values():
                one(stamp, seconds)
        elif count := self.kernel(rows.kernels, stamp, seconds):
            self.end(count, stamp, seconds)

    def end(self, count: int, stamp: float, seconds: float) -> None:
        """Sense for the ``count`` rows that the kernel has left."""
        for index in self.rows.others[:count].tolist():
            if index in self.alone:  # one that joined in this tick begins with the next
                self.alone[index](stamp, seconds)
