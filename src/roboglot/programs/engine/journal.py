"""The journal of a run: lets the program continue after the server was killed.

Before a call with an effect begins, the call and all earlier answers are written to disk, so that a call interrupted
by a crash is known and never made twice. Its answer is written a moment later. If an answer was lost, a call that only
reads is made again, and any other is reported as interrupted. Knows no process.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Mapping, Sequence

import msgspec

from roboglot.programs.engine.events import Answer
from roboglot.programs.stores import JournalEntry, JournalStore
from roboglot.values import dataclass

log = logging.getLogger(__name__)

CALLS_MAX = 100_000
BYTES_MAX = 32 * 1024 * 1024
"""Longer runs cannot be continued, as a program replays all its calls."""
_READING = (
    *(".state", ".data", ".params", ".set_log", ".block", ".breakpoint_block"),
    *(".get_data", ".get_volume", ".get_preset", ".get_training_words_set", ".instant_recognized"),
)


class Header(msgspec.Struct, frozen=True):
    """Start conditions of a run; together with its answers they determine its behaviour.

    ``watched``: True if the program can be stepped through.
    """

    body: str
    modules: dict[str, str]
    utc_offset: int
    seed: int
    watched: bool = False


@dataclass(frozen=True, slots=True)
class History:
    """Record of a lost run.

    ``interrupted``: the call in progress at its end, "" for none; it is the last of ``answers``, without a body.
    """

    header: Header
    answers: Sequence[Answer]
    interrupted: str


def does_something(name: str) -> bool:
    """Return whether a call has an effect beyond its answer."""
    return not name.startswith("time.") and not name.endswith(_READING)


def header_of(
    body: str, modules: Mapping[str, str], utc_offset: int, *, watched: bool = False, seed: int | None = None
) -> Header:
    """Return the header of a new run; the seed is random if None."""
    return Header(body, dict(modules), utc_offset, secrets.randbits(63) if seed is None else seed, watched)


class Journal:
    """Journal of one run. After a failed write the program continues, but cannot be recovered after a crash."""

    def __init__(self, store: JournalStore, id: str) -> None:
        self._store = store
        self._id = id
        self._pending: list[JournalEntry] = []
        self._seq = self._size = 0
        self._order = asyncio.Lock()
        self._writing: asyncio.Task[None] | None = None
        self.kept = True
        """True if the run can continue after a crash."""

    async def open(self, header: Header) -> None:
        """Begin the journal of a new run."""
        await self._store.begin(self._id, msgspec.json.encode(header).decode())

    async def reopen(self, header: str) -> History:
        """Return the lost run and continue its journal. Raises ValueError for a header of another version."""
        entries = await self._store.entries(self._id)
        answers = [Answer(entry.name, entry.answer) for entry in entries]
        interrupted = answers[-1].name if answers and answers[-1].body is None else ""
        self._seq = len(answers) - bool(interrupted)
        self._size = sum(len(answer.body or b"") for answer in answers)
        return History(msgspec.json.decode(header, type=Header), answers, interrupted)

    async def begin(self, name: str) -> None:
        """Record a call before it is made; if it has an effect, return once the record survives a crash."""
        if self.kept and does_something(name):
            self._pending.append(JournalEntry(self._seq, name, None))
            await self._flush()

    def answered(self, name: str, body: bytes) -> None:
        """Record an answer that was sent; it is written in the background."""
        if not self.kept:
            return
        self._pending.append(JournalEntry(self._seq, name, body))
        self._seq += 1
        self._size += len(body)
        if self._writing is None or self._writing.done():
            self._writing = asyncio.create_task(self._flush(), name=f"journal {self._id}")

    async def written(self) -> None:
        """Return once all answers survive a crash."""
        await self._flush()

    async def close(self) -> None:
        """Delete the journal of a finished run."""
        self.kept = False
        if self._writing is not None:
            await self._writing
        await self._store.remove(self._id)

    async def _flush(self) -> None:
        async with self._order:
            while self._pending and self.kept:  # more may arrive during the write
                entries, self._pending = self._pending, []
                try:
                    if self._seq > CALLS_MAX or self._size > BYTES_MAX:
                        await self._give_up("it has become too long")
                    else:
                        await self._store.write(self._id, entries)
                except Exception as error:  # noqa: BLE001 - whatever a store raises, the run goes on
                    await self._give_up(str(error))

    async def _give_up(self, why: str) -> None:
        self.kept = False
        log.warning("the run of %s cannot continue after a crash: %s", self._id, why)
        await self._store.remove(self._id)
