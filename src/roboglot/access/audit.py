"""Writer of the audit of changes and refusals.

A thread writes rows at once, many together, so that no request waits for the disk; a written row survives ``kill -9``.
Rows hold names of operations and reasons, never the data sent. While the table cannot be written, rows wait.
"""

from __future__ import annotations

import logging
import math
import queue
import threading
import time
from collections.abc import Sequence
from typing import NamedTuple, Protocol

from roboglot.access.trail import Entry
from roboglot.storage.transactions import FAILURES
from roboglot.transport.limiter import Limiter

log = logging.getLogger(__name__)

WAITING_MAX = 10_000  # rows waiting to be written; beyond this they are dropped and a row records how many
TOGETHER_MAX = 500  # rows per transaction
AGAIN_SECONDS = 1.0  # between two attempts to write them
REPEATED_WITHIN = 1.0  # s within which an equal row is counted instead of written again
STRANGERS = "unknown clients come too often for a row each"
STRANGERS_BURST, STRANGERS_RATE = 60, 1.0  # rows, and rows a second, of unknown clients; beyond that they share a row
KINDS_MAX = 1024  # different rows whose repetitions are counted at the same time
CLOSE_SECONDS = 5.0


class Rows(Protocol):
    """Keeper of rows: a ``Trail``."""

    def add(self, entries: Sequence[Entry], /) -> None:
        """Store rows before it returns. Raises DatabaseError, DiskFull."""


class _Kind(NamedTuple):
    """A series of equal entries: time of the written row (Unix s), number of entries since, and the last of them."""

    written: float
    repeats: int
    last: Entry


class Audit:
    """Writes to ``trail``: ``note`` from any thread, ``close`` at the end. The trail stays open."""

    def __init__(self, trail: Rows) -> None:
        self._queue: queue.SimpleQueue[Entry | None] = queue.SimpleQueue()
        self._trail = trail
        self._kinds: dict[tuple[str, ...], _Kind] = {}
        self._lock = threading.Lock()
        self._dropped = 0
        self._strangers = Limiter(STRANGERS_RATE, STRANGERS_BURST, time.monotonic)
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._write, name="audit", daemon=True)
        self._thread.start()

    def note(self, entry: Entry) -> None:
        """Queue an entry. Equal ones within REPEATED_WITHIN are only counted: a joystick sends 50 commands a second."""
        with self._lock:
            if not entry.who and not self._is_repeated(entry) and not self._strangers.take(""):
                entry = entry._replace(address="", door="", operation="", reason=STRANGERS)
            key = _key(entry)
            kind = self._kinds.get(key)
            if kind is not None and self._is_repeated(entry):
                self._kinds[key] = _Kind(kind.written, kind.repeats + 1, entry)
                return
            if kind is None and len(self._kinds) >= KINDS_MAX:
                self._put_repeats(self._kinds.pop(next(iter(self._kinds))))
            self._kinds[key] = _Kind(entry.at, 0, entry)
            self._put(entry._replace(repeats=kind.repeats if kind else 0))

    def _is_repeated(self, entry: Entry) -> bool:
        kind = self._kinds.get(_key(entry))
        return kind is not None and entry.at - kind.written < REPEATED_WITHIN

    def close(self) -> None:
        """Write waiting rows; the log reports rows that cannot be written in time."""
        self._settle(math.inf)
        self._queue.put(None)
        self._closing.set()
        self._thread.join(CLOSE_SECONDS)
        if self._thread.is_alive():
            log.error("cannot write the rest of the audit: its database does not answer")

    def _settle(self, until: float) -> None:
        """Write rows of counted repetitions whose series have ended by ``until``."""
        with self._lock:
            for key, kind in self._kinds.items():
                if kind.repeats and until - kind.written >= REPEATED_WITHIN:
                    self._put_repeats(kind)
                    self._kinds[key] = _Kind(kind.last.at, 0, kind.last)

    def _put_repeats(self, kind: _Kind) -> None:
        if kind.repeats:
            self._put(kind.last._replace(repeats=kind.repeats - 1))

    def _put(self, entry: Entry) -> None:
        if self._queue.qsize() >= WAITING_MAX:
            self._dropped += 1
            return
        if self._dropped:
            lost, self._dropped = self._dropped, 0
            self._queue.put(Entry(entry.at, "", "", "", "", "audit", "dropped", f"{lost} rows: the disk is too slow"))
        self._queue.put(entry)

    def _write(self) -> None:
        ended, settled = False, now()
        while not ended:
            taken = self._take()
            if not taken or now() - settled >= REPEATED_WITHIN:
                self._settle(now())
                settled = now()
            ended = bool(taken) and taken[-1] is None
            if entries := [entry for entry in taken if entry is not None]:
                self._keep(entries)

    def _take(self) -> list[Entry | None]:
        """Return waiting rows, or none after REPEATED_WITHIN s. The writing thread is the only reader."""
        try:
            taken = [self._queue.get(timeout=REPEATED_WITHIN)]
        except queue.Empty:
            return []
        while len(taken) < TOGETHER_MAX and taken[-1] is not None and not self._queue.empty():
            taken.append(self._queue.get())
        return taken

    def _keep(self, entries: list[Entry]) -> None:
        """Write rows, with retries until that works; with one retry while the program ends."""
        last = False
        while True:
            try:
                self._trail.add(entries)
            except FAILURES as error:
                if last:
                    log.error("%d rows of the audit are lost: %s", len(entries), error)
                    return
                log.error("cannot write the audit yet: %s", error)
            else:
                return
            last = self._closing.wait(AGAIN_SECONDS)


def _key(entry: Entry) -> tuple[str, ...]:
    """Return what equal entries share: another connection from the same host makes no other kind."""
    return entry.who, entry.address.rpartition(":")[0], *entry[3:8]


def now() -> float:
    """Return the machine's time, Unix s."""
    return time.time()
