"""Interfaces of the programs' stores, and the records kept there. `roboglot.storage` implements them.

Once a write has returned, it survives a crash. Every method raises StoreError (`roboglot.programs.errors`) if the
store fails; methods that end in ``_now`` block and are for start-up.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

from roboglot.values import dataclass

LOG_MAX = 1000
"""Entries kept per program; the oldest go first."""
LOG_TEXT_MAX = 4000
"""Characters of one entry."""


@dataclass(frozen=True, slots=True)
class StoredProgram:
    """A saved task or module.

    ``style`` is the editor's own text, ``state`` a word of the state table. ``due``: start of a scheduled task, Unix s;
    None: no time is set. ``owner``: identity that last wrote or ran a task, whose rights it has; empty: no identity
    was required.
    """

    id: str
    describe: str
    style: str
    mode: str
    condition: str
    body: str
    state: str
    due: float | None = None
    owner: str = ""


@dataclass(frozen=True, slots=True)
class ListedProgram:
    """A task or module in a list: without its body, with the ids of the modules it calls and of its callers."""

    id: str
    describe: str
    style: str
    mode: str
    condition: str
    state: str
    uses: tuple[str, ...]
    used_by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class LogEntry:
    """One line of a program's log: ``at`` in seconds since 1970, ``level`` is print, call, note or error."""

    at: float
    level: str
    text: str


@dataclass(frozen=True, slots=True)
class JournalEntry:
    """One call of a run; ``answer`` is None while the call is in progress."""

    seq: int
    name: str
    answer: bytes | None


class ProgramStore(Protocol):
    """The tasks or the modules of one robot, with their logs."""

    async def get(self, id: str) -> StoredProgram | None:
        """Return the program with this id, or None."""

    async def all(self, ids: Collection[str] = ()) -> list[ListedProgram]:
        """Return those of ``ids`` that exist, or all if ``ids`` is empty; by id, ascending."""

    async def count(self) -> int:
        """Return the number of programs."""

    async def put(self, program: StoredProgram, uses: Collection[str] | None = None) -> None:
        """Add a program or replace the one with the same id; ``uses``: the modules it calls, None: unchanged."""

    async def used_by(self, module: str) -> list[str]:
        """Return the ids of the tasks and modules that call ``module``, in order."""

    async def uses(self, id: str) -> list[str]:
        """Return the ids of the modules that a program calls directly, in order."""

    async def set_state(self, id: str, state: str, log: Sequence[LogEntry] = ()) -> None:
        """Change the state and append to the log in one transaction."""

    async def remove(self, id: str) -> None:
        """Delete a program and its log; do nothing if there is none."""

    async def append_log(self, id: str, entries: Sequence[LogEntry]) -> None:
        """Append entries to a program's log."""

    async def log(self, id: str) -> list[LogEntry]:
        """Return the newest ``LOG_MAX`` entries, oldest first."""

    def names_now(self) -> list[tuple[str, str, str, frozenset[str]]]:
        """Return id, condition, state and used modules of all programs."""

    def settle_now(self, states: Mapping[str, str], note: LogEntry) -> None:
        """Change states by id and append the same note to each log."""

    def in_states_now(self, states: Collection[str]) -> list[StoredProgram]:
        """Return all programs in one of these states, by id."""


class JournalStore(Protocol):
    """The journals of one robot's runs, by task."""

    async def begin(self, id: str, header: str) -> None:
        """Start an empty journal in place of any earlier one."""

    async def write(self, id: str, entries: Sequence[JournalEntry]) -> None:
        """Add entries; one with a known number replaces the earlier one."""

    async def remove(self, id: str) -> None:
        """Delete a journal."""

    async def entries(self, id: str) -> list[JournalEntry]:
        """Return all calls in order."""

    def headers_now(self) -> dict[str, str]:
        """Return the headers of all journals by task."""

    def remove_now(self, ids: Collection[str]) -> None:
        """Delete these journals."""


@dataclass(frozen=True, slots=True)
class Stores:
    """All stores of one robot's programs."""

    tasks: ProgramStore
    modules: ProgramStore
    journals: JournalStore
