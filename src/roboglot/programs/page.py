"""The server's end of the memory that it shares with one worker: where the program is, and where it is to halt.

A hostile worker writes there what it likes: all that is read means a place at most.
"""

from __future__ import annotations

import mmap

from roboglot.programs.language.places import WORD, Places


class Page:
    """``memory``: a descriptor of shared memory of ``places.memory()`` bytes, which the caller closes."""

    def __init__(self, memory: int, places: Places) -> None:
        self._memory = mmap.mmap(memory, places.memory())
        self._places = places
        self._last = (0, 0)

    @property
    def place(self) -> tuple[int, int]:
        """The unit and the line, as the worker has it now; once closed, the last one."""
        if self._memory.closed:
            return self._last
        address = self._memory[:WORD]
        end = self._places.stops
        at = self._memory.find(address, WORD, end)
        while at >= 0 and at % WORD:
            at = self._memory.find(address, at + 1, end)
        return self._places.place(at // WORD - 1)

    def stop_next(self, on: bool) -> None:
        """Halt before whichever statement comes next, or not any more."""
        self._set(0, on)

    def stop_at(self, unit: int, line: int) -> None:
        """Halt there, or where the next statement of the unit begins. ValueError for a line that is not there."""
        number = self._places.number(unit, line)
        if not number:
            raise ValueError(f"there is no line {line}")
        # As long as the worker has not read the program, there are no marks; it moves the stop by itself then.
        self._set(self._places.next_marked(number, self._marked) or number, True)

    def clear_stops(self) -> None:
        """Halt nowhere."""
        if not self._memory.closed:
            self._memory[self._places.stops + 1 :] = bytes(self._places.count - 1)

    def close(self) -> None:
        """The worker is gone."""
        self._last = self.place
        self._memory.close()

    def _marked(self, number: int) -> bool:
        at = WORD * (1 + number)
        return not self._memory.closed and any(self._memory[at : at + WORD])

    def _set(self, number: int, on: bool) -> None:
        if not self._memory.closed:
            self._memory[self._places.stops + number] = on
