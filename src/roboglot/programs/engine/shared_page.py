"""The server's end of the memory shared with one worker: the program's place and its stops.

A hostile worker can write anything there; the server only interprets it as a place.
"""

from __future__ import annotations

import mmap

import numpy as np
from numpy.typing import NDArray

from roboglot.programs.language.places import WORD, Places, Step

SEARCHED_MAX = 256 * 1024
"""Most places that are searched; later places count as unknown. A longer search would delay the server."""
STEP_BITS, ORDERS = 2, 64  # the order in a step is one byte
FOUND_MAX = 4096
"""Most addresses whose places are cached: a program calls from the same few lines again and again."""

_NOWHERE = (0, (0, 0))


class Page:
    """Mapped shared memory. ``memory``: descriptor of ``places.memory()`` bytes, closed by the caller."""

    def __init__(self, memory: int, places: Places) -> None:
        self._memory = mmap.mmap(memory, places.memory())
        # Aligned words: in a search by bytes, a worker could craft a pattern that matches at every second byte.
        self._words: NDArray[np.uint64] = np.frombuffer(self._memory, np.uint64, 1 + min(places.count, SEARCHED_MAX))
        self._places = places
        self._found: dict[int, tuple[int, tuple[int, int]]] = {}
        self._last = (0, 0)
        self._orders = 0

    @property
    def place(self) -> tuple[int, int]:
        """Current unit and line, as reported by the worker; after ``close`` the last ones."""
        if self._memory.closed:
            return self._last
        words = self._words
        address = words.item(0)
        number, place = self._found.get(address, _NOWHERE)
        if not number or words.item(1 + number) != address:  # not written yet, or moved by a hostile worker
            number = self._search(address)
            place = self._places.place(number)
            if len(self._found) < FOUND_MAX:
                self._found[address] = number, place
        return place

    def order(self, step: Step) -> None:
        """Halt after a step from here."""
        self._orders = (self._orders + 1) % ORDERS
        self._set(0, self._orders << STEP_BITS | step)

    def take_back(self) -> None:
        """Cancel the ordered step."""
        self._set(0, 0)

    def stops(self, unit: int, line: int) -> bool:
        """Return whether the line has a breakpoint."""
        number = self._places.number(unit, line)
        return not self._memory.closed and number > 0 and bool(self._memory[self._places.stops + number])

    def stop_at(self, unit: int, line: int) -> None:
        """Halt at the line, or at the unit's next statement. Raises ValueError for a line that does not exist."""
        number = self._places.number(unit, line)
        if not number:
            raise ValueError(f"there is no line {line}")
        # Until the worker has read the program there are no marks; it then moves the stop itself.
        self._set(self._places.next_marked(number, self._marked) or number, 1)

    def clear_stops(self) -> None:
        """Remove all breakpoints."""
        if not self._memory.closed:
            self._memory[self._places.stops + 1 :] = bytes(self._places.count - 1)

    def close(self) -> None:
        """Keep the last place and release the memory."""
        self._last = self.place
        self._words = self._words[:0].copy()  # no view of the memory may remain
        self._memory.close()

    def _search(self, address: int) -> int:
        hits = self._words[1:] == address
        number = int(hits.argmax())
        return number if hits[number] else 0

    def _marked(self, number: int) -> bool:
        at = WORD * (1 + number)
        return not self._memory.closed and any(self._memory[at : at + WORD])

    def _set(self, number: int, value: int) -> None:
        if not self._memory.closed:
            self._memory[self._places.stops + number] = value
