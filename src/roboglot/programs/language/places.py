"""Places of a program and its stops: a place is a line of a unit (0 is the program, 1... its modules).

Both ends of the shared memory number all places of a run in one sequence, from the same texts. Pure arithmetic.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from enum import IntEnum
from itertools import accumulate

WORD = 8
"""Bytes of an entry in the shared memory."""


class Step(IntEnum):
    """Kind of a step: the statement before which the program halts next."""

    INTO = 1
    """The next statement, in any function."""
    OVER = 2
    """The next statement in the current function or one of its callers."""
    OUT = 3
    """The next statement in a caller of the current function."""


class Places:
    """The sequence of all places of a run; number 0 means "no place yet"."""

    __slots__ = ("_starts", "count")

    def __init__(self, units: Sequence[str]) -> None:
        # A superset: every line ending that Python recognizes contains one of these.
        lengths = [unit.count("\n") + unit.count("\r") + 2 for unit in units]
        self._starts = list(accumulate(lengths, initial=1))
        self.count = self._starts.pop()

    def number(self, unit: int, line: int) -> int:
        """Return the number of a place, 0 if there is no such line."""
        if not 0 <= unit < len(self._starts):
            return 0
        number = self._starts[unit] + line
        end = self._starts[unit + 1] if unit + 1 < len(self._starts) else self.count
        return number if line > 0 and number < end else 0

    def place(self, number: int) -> tuple[int, int]:
        """Return the unit and the line of a number; (0, 0) for an invalid one."""
        if not 0 < number < self.count:
            return 0, 0
        unit = bisect_right(self._starts, number) - 1
        return unit, number - self._starts[unit]

    def memory(self) -> int:
        """Return the size of the shared memory, bytes: the current place's word, and a word and a byte per place."""
        return self.stops + self.count

    @property
    def stops(self) -> int:
        """Offset of the stops, one byte per place; not 0: a watched program halts there.

        The first byte orders a step: a ``Step`` in its lowest two bits, above them a number that changes with each
        order.
        """
        return WORD * (1 + self.count)

    def next_marked(self, number: int, marked: Callable[[int], bool]) -> int:
        """Return the first place from ``number`` on, in the same unit, at which a statement begins; 0 without one."""
        unit = bisect_right(self._starts, number)
        end = self._starts[unit] if unit < len(self._starts) else self.count
        return next((place for place in range(number, end) if marked(place)), 0)
