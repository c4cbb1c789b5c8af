"""Numbers of all robots of a world in tables, a row each, so that one kernel computes a tick of all of them.

A part keeps there what it computes together with its like (``Part.together``), and reads and writes its own row.
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
    reckon: Callable[..., int]
    touch: Callable[..., int]


@dataclass(frozen=True, slots=True)
class Leg:
    """Stage of a tick in ``kernels/ticks.py``, with the tables and numbers it takes; ``refresh`` updates the tables."""

    stage: int
    tables: tuple[FloatArray, ...]
    settings: tuple[float, ...] = ()
    refresh: Callable[[], None] | None = None


class Rows:
    """Tables for ``robots`` robots. ``kernels``: None until they are loaded; ``others``: room for their answer."""

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
            together.reckon,
            together.touch,
        )

    def table(self, name: str, width: int) -> FloatArray:
        """Return the table of this name, made with zeros at first; ``width``: numbers in a row."""
        if name not in self._tables:
            self._tables[name] = np.zeros((self._robots, width))
        return self._tables[name]

    def control(self, alone: Mapping[int, Control], kernel: Callable[[Kernels, float], int], leg: Leg) -> SharedControl:
        """Return what controls with ``kernel`` and those of ``alone``, as ``sense`` does for sensing."""
        return SharedControl(self, alone, kernel, leg)

    def sense(
        self, alone: Mapping[int, Sense], kernel: Callable[[Kernels, float, float], int], leg: Leg | None = None
    ) -> SharedSense:
        """Return what senses with one call of ``kernel``, and with those of ``alone`` that it leaves.

        Without kernels with all of them. The keys of ``alone`` are rows; the kernel's answer is how many it has left.
        ``leg``: its part in the kernel that does all in one (``kernels/ticks.py``).
        """
        return SharedSense(self, alone, kernel, leg)


@dataclass(frozen=True, slots=True)
class Seat:
    """One robot's place in all tables."""

    rows: Rows
    index: int

    def row(self, name: str, width: int) -> memoryview[float]:
        """Return its row of a table, with zeros; a number of it is read and written quicker than in an array."""
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
        """Sense with the ``count`` that the kernel has left."""
        for index in self.rows.others[:count].tolist():
            if index in self.alone:  # else it joined in this tick, and begins with the next
                self.alone[index](stamp, seconds)
