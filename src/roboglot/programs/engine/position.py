"""Position and stops of a run's program, by module and line, in its shared memory."""

from __future__ import annotations

from collections.abc import Iterable

from roboglot.programs.engine.shared_page import Page
from roboglot.programs.language.places import Step
from roboglot.programs.library.program import Program


class Position:
    """Position as reported by the worker, which may be hostile and lie.

    ``watched``: True if the program can be stepped through and halts at lines.
    """

    __slots__ = ("_page", "_program", "watched")

    def __init__(self, program: Program, page: Page, *, watched: bool) -> None:
        self._program = program
        self._page = page
        self.watched = watched

    @property
    def now(self) -> tuple[str, int]:
        """Unit and line, read together."""
        unit, line = self._page.place
        return self._program.unit_name(unit), line

    @property
    def line(self) -> int:
        """Current line, 0 before the first."""
        return self._page.place[1]

    @property
    def unit(self) -> str:
        """Module of the current line, "" for the program itself."""
        return self._program.unit_name(self._page.place[0])

    @property
    def source_line(self) -> str:
        """Text of the current line, "" if there is no such line."""
        return self._program.source_line(*self._page.place)

    def source_of(self, unit: int, line: int) -> tuple[str, str]:
        """Return the module and the text of a line that the worker reports."""
        return self._program.unit_name(unit), self._program.source_line(unit, line)

    def step(self, step: Step = Step.INTO) -> None:
        """Halt after a step from here; does not resume a waiting or suspended program."""
        if self.watched:
            self._page.order(step)

    @property
    def at_stop(self) -> bool:
        """True if the current line has a breakpoint."""
        return self._page.stops(*self._page.place)

    def stop_at(self, lines: Iterable[tuple[str, int]]) -> None:
        """Halt before the statements at these lines (module or "", line) and no others.

        A line without a statement stands for the next statement. Raises LookupError for a line that does not exist.
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
        """Release the shared memory; the last position stays readable."""
        self._page.close()
