"""Reports the program's position to the host without a call: a store into shared memory.

``cell`` is a list of one item that lies in the shared memory: a mark stores the address of an object there that stands
for a place. The rest of the memory maps addresses to places. Nothing is converted at run time, so a mark is as cheap
as ``x[0] = y``. Knows CPython's memory layout, and no program.
"""

from __future__ import annotations

import ctypes
import mmap
import sys
from collections.abc import Callable
from types import FrameType

from roboglot.programs.language.places import WORD, Places, Step

_ITEMS = ctypes.sizeof(ctypes.c_ssize_t) * 2 + ctypes.sizeof(ctypes.c_void_p)
"""Offset of the address of a list's items, bytes: after reference count, type and size."""


class PositionMemory:
    """The worker's end of the shared memory of ``Places.memory()`` bytes. Lives as long as the process."""

    def __init__(self, memory: mmap.mmap) -> None:
        self._memory = memory
        self._table = (ctypes.c_size_t * (len(memory) // WORD)).from_buffer(memory)
        self._places = Places(())
        self._marks: dict[int, object] = {}
        self._numbers: dict[object, int] = {}
        self._watched: Watched | None = None
        self.cell: list[object] = [None]
        nowhere = self._marked(0)
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(nowhere))  # the reference that the first store releases
        self._table[0] = id(nowhere)
        ctypes.c_void_p.from_address(id(self.cell) + _ITEMS).value = ctypes.addressof(self._table)
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(self))  # freeing the list would free memory it does not own

    def lay_out(self, places: Places) -> None:
        """Set the places of the program's texts."""
        self._places = places

    def mark(self, unit: int, line: int) -> object:
        """Return the object that stands for a line."""
        number = self._places.number(unit, line)
        return self._marked(number if number + 1 < len(self._table) else 0)

    def watched(self, halt: Callable[[], object]) -> Watched:
        """Return a replacement for ``cell``, for a program that halts at the host's stops."""
        self._watched = Watched(self.cell, self._numbers, self._stops(), halt)
        return self._watched

    def forget(self) -> None:
        """Release the frames of the program."""
        if self._watched is not None:
            self._watched.forget()

    def settle(self) -> None:
        """Move stops at lines without a statement to the next statement, once all marks are made."""
        stops = self._stops()
        for number in [number for number in range(1, len(stops)) if stops[number] and number not in self._marks]:
            stops[number] = 0
            if found := self._places.next_marked(number, self._marks.__contains__):
                stops[found] = 1

    def _stops(self) -> memoryview:
        return memoryview(self._memory)[self._places.stops : self._places.memory()]

    def works(self) -> bool:
        """Return whether this Python stores lists as expected; otherwise no line can be reported."""
        other = self._marked(1) if len(self._table) > 2 else self._marks[0]
        before, self.cell[0] = self.cell[0], other
        held = self._table[0] == id(other)
        self.cell[0] = before
        return held and self._table[0] == id(before)

    def _marked(self, number: int) -> object:
        if number not in self._marks:
            self._marks[number] = mark = object()
            self._numbers[mark] = number
            self._table[1 + number] = id(self._marks[number])
        return self._marks[number]


class Watched:
    """Takes marks like ``cell``, and checks at each whether to halt; slower, for watched programs."""

    __slots__ = ("_cell", "_frame", "_halt", "_numbers", "_order", "_origin", "_stops")

    def __init__(
        self, cell: list[object], numbers: dict[object, int], stops: memoryview, halt: Callable[[], object]
    ) -> None:
        self._cell, self._numbers, self._stops, self._halt = cell, numbers, stops, halt
        self._order = 0
        self._frame: FrameType | None = None  # of the last mark
        self._origin: FrameType | None = None  # where the step was ordered

    def __setitem__(self, item: int, mark: object) -> None:
        self._cell[item] = mark
        stops, frame = self._stops, sys._getframe(1)
        halts = stops[self._numbers[mark]] or (stops[0] and self._stepped(stops[0], frame))
        self._frame = frame
        if halts:
            self._halt()

    def _stepped(self, order: int, here: FrameType) -> bool:
        """Return whether the step is done: OVER skips calls, OUT also the rest of the current function."""
        if order != self._order:
            self._order, self._origin = order, self._frame
        step = order & max(Step)
        if step == Step.INTO:
            return True
        frame = here if step == Step.OUT else here.f_back
        while frame is not None:
            if frame is self._origin:
                return False
            frame = frame.f_back
        self._origin = None
        return True

    def forget(self) -> None:
        """Release the frames and their variables."""
        self._frame = self._origin = None
