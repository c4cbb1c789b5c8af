"""Tables of numbers with a row for each robot of a world, so that one kernel computes a tick of all robots.

A part that is computed for all robots at once (``Part.sense_all``) keeps its state there, in its own row.
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
    """The compiled functions of ``kernels/batch.py``."""

    all_below: Callable[..., bool]
    turn_gimbals: Callable[..., int]
    drive_wheels: Callable[..., None]
    read_motion: Callable[..., int]
    measure_imus: Callable[..., int]
    watch_motion: Callable[..., int]
    dead_reckon: Callable[..., int]
    find_docks: Callable[..., int]


@dataclass(frozen=True, slots=True)
class TickStage:
    """Stage of a tick in ``kernels/ticks.py``, with the tables and numbers it takes; ``refresh`` updates the tables."""

    number: int
    tables: tuple[FloatArray, ...]
    settings: tuple[float, ...] = ()
    refresh: Callable[[], None] | None = None


class RobotTables:
    """Tables for ``robots`` robots. ``kernels``: None until loaded; ``others``: buffer for rows that they leave.

    ``before_change`` is called before a robot that may be at rest is moved, or a part of it begins or ends to work.
    """

    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._tables: dict[str, FloatArray] = {}
        self.kernels: Kernels | None = None
        self.others: IntArray = np.zeros(robots, np.int64)
        self.before_change: Callable[[], None] = lambda: None

    def load_kernels(self) -> None:
        """Compute with the compiled kernels from now on; results stay the same, to the last bit."""
        with loading():
            from roboglot.kernels import batch

        self.kernels = Kernels(
            batch.all_below,
            batch.turn_gimbals,
            batch.drive_wheels,
            batch.read_motion,
            batch.measure_imus,
            batch.watch_motion,
            batch.dead_reckon,
            batch.find_docks,
        )

    def table(self, name: str, width: int) -> FloatArray:
        """Return the table of this name, at first full of zeros; ``width``: numbers in a row."""
        if name not in self._tables:
            self._tables[name] = np.zeros((self._robots, width))
        return self._tables[name]

    def control(
        self, single: Mapping[int, Control], kernel: Callable[[Kernels, float], int], stage: TickStage
    ) -> BatchedControl:
        """Return control by ``kernel``, and by ``single`` for rows that it leaves; see ``sense``."""
        return BatchedControl(self, single, kernel, stage)

    def sense(
        self,
        single: Mapping[int, Sense],
        kernel: Callable[[Kernels, float, float], int],
        stage: TickStage | None = None,
    ) -> BatchedSense:
        """Return sensing by one call of ``kernel``, and by ``single`` (by row) for rows that it leaves.

        While there are no kernels, ``single`` does all rows. The kernel returns the number of rows that it has left.
        ``stage``: the same stage in the kernel of whole ticks (``kernels/ticks.py``).
        """
        return BatchedSense(self, single, kernel, stage)


@dataclass(frozen=True, slots=True)
class RobotRows:
    """One robot's rows: one in every table."""

    tables: RobotTables
    index: int

    def row(self, name: str, width: int) -> memoryview[float]:
        """Return the robot's row of a table, set to zeros; single numbers are quicker to access than in an array."""
        self.tables.table(name, width)[self.index] = 0.0
        row: memoryview[float] = memoryview(self.tables.table(name, width)[self.index]).cast("B").cast("d")
        return row


@dataclass(frozen=True, slots=True)
class BatchedControl:
    """Control of one kind of part of all robots; see ``RobotTables.control``."""

    tables: RobotTables
    single: Mapping[int, Control]
    kernel: Callable[[Kernels, float], int]
    stage: TickStage

    def __call__(self, seconds: float) -> None:
        """Control all."""
        tables = self.tables
        if tables.kernels is None:
            for one in self.single.values():
                one(seconds)
        elif count := self.kernel(tables.kernels, seconds):
            for index in tables.others[:count].tolist():
                self.single[index](seconds)


@dataclass(frozen=True, slots=True)
class BatchedSense:
    """Sensing of one kind of part of all robots; see ``RobotTables.sense``."""

    tables: RobotTables
    single: Mapping[int, Sense]
    kernel: Callable[[Kernels, float, float], int]
    stage: TickStage | None

    def __call__(self, stamp: float, seconds: float) -> None:
        """Sense with all."""
        tables = self.tables
        if tables.kernels is None:
            for one in self.single.values():
                one(stamp, seconds)
        elif count := self.kernel(tables.kernels, stamp, seconds):
            self.end(count, stamp, seconds)

    def end(self, count: int, stamp: float, seconds: float) -> None:
        """Sense for the ``count`` rows that the kernel has left."""
        for index in self.tables.others[:count].tolist():
            if index in self.single:  # one that joined in this tick begins with the next
                self.single[index](stamp, seconds)
