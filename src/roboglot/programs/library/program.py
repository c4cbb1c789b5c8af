"""The texts of a program, and the places in them. Knows no process."""

from __future__ import annotations

from dataclasses import field

from roboglot.programs.language.places import Places
from roboglot.values import dataclass


@dataclass(frozen=True, slots=True)
class Program:
    """Texts that a run executes: unit 0 is the program, the others its modules.

    ``names``: names of the modules, "" for the program.
    """

    units: tuple[str, ...]
    names: tuple[str, ...]
    places: Places = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "places", Places(self.units))

    def unit_name(self, unit: int) -> str:
        """Return the module of a unit; "" for the program and for invalid numbers."""
        return self.names[unit] if 0 <= unit < len(self.names) else ""

    def source_line(self, unit: int, line: int) -> str:
        """Return a line's text, "" if there is no such line."""
        if not 0 <= unit < len(self.units):
            return ""
        lines = self.units[unit].splitlines()
        return lines[line - 1].strip() if 1 <= line <= len(lines) else ""
