"""Position and stops of a run's program: the places of its shared memory by module and line."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.programs.engine.shared_page import Page
from roboglot.programs.language.places import Step
from roboglot.programs.library.program import Program


class Position:
    """The program's own account of its place: a hostile worker can lie.

    ``watched``: True if the program can be stepped through and halts at lines.
    """

    __slots__ = ("_page", "_program", "watched")

    def __init__(self, program: Program, page: Page, *, watched: bool) -> None:
        self._program = program
        self._page = page
        self.watched = watched

    @property
    def now(self) -> tuple[str, int]:
        """The unit and the line in one look."""
        unit, line = self._page.place
        return self._program.unit_name(unit), line

    @property
    def line(self) -> int:
        """The line that is running or waiting now, 0 before the first."""
        return self._page.place[1]

    @property
    def unit(self) -> str:
        """The module of the line, "" for the program itself."""
        return self._program.unit_name(self._page.place[0])

    @property
    def source_line(self) -> str:
        """The text of the line, "" if there is no such line."""
        return self._program.source_line(*self._page.place)

    def source_of(self, unit: int, line: int) -> tuple[str, str]:
        """Return the module and the text of a line that the worker reports."""
        return self._program.unit_name(unit), self._program.source_line(unit, line)

    def step(self, step: Step = Step.INTO) -> None:
        """Halt after a step from here; a waiting or suspended program has to be continued besides."""
        if self.watched:
            self._page.order(step)

    @property
    def at_stop(self) -> bool:
        """True if it halts at this line each time."""
        return self._page.stops(*self._page.place)

    def stop_at(self, lines: Iterable[tuple[str, int]]) -> None:
        """Halt before the statements at these lines (module or "", line) and no others.

        A line without a statement means the next one with one. Raises LookupError for a line that does not exist.
        """
        names = self._program.names
        places = [(names.index(unit) if unit in names else -1, line) for unit, line in lines]
        if wrong := [line for unit, line in places if not self._program.places.number(unit, line)]:
            raise LookupError(f"there is no line {wrong[0]}")
        self._page.clear_stops()
        for place in places if self.watched else ():
            self._page.stop_at(*place)

    def clear_step(self) -> None:
        """Cancel ``step``."""
        self._page.take_back()

    def close(self) -> None:
        """Release the shared memory; the last place stays."""
        self._page.close()
