"""Who changed what, and what was refused: a table that only grows, each row with the hash of the one before.

A thread writes what is noted, at once and many rows together, so that no request waits for the disk; a row that is
written survives ``kill -9``. Rows hold names of operations and reasons, and never what was sent.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import logging
import math
import queue
import sqlite3
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

log = logging.getLogger(__name__)

FILE = "audit.db"  # in the data folder
WAITING_MAX = 10_000  # rows that wait for the disk; then they are dropped, and a row says how many
TEXT_MAX = 300  # characters of one field
REPEATED_WITHIN = 1.0  # s: the same again so soon is counted, and the count written then
KINDS_MAX = 1024  # different rows whose repetitions are counted
_SCHEMA = """
CREATE TABLE IF NOT EXISTS audit (
    number INTEGER PRIMARY KEY, at REAL NOT NULL, who TEXT NOT NULL, address TEXT NOT NULL, robot TEXT NOT NULL,
    door TEXT NOT NULL, operation TEXT NOT NULL, outcome TEXT NOT NULL, reason TEXT NOT NULL,
    repeats INTEGER NOT NULL, hash TEXT NOT NULL
) STRICT;
CREATE TRIGGER IF NOT EXISTS audit_stays BEFORE UPDATE ON audit BEGIN SELECT RAISE(ABORT, 'the audit stays'); END;
CREATE TRIGGER IF NOT EXISTS audit_is_kept BEFORE DELETE ON audit BEGIN SELECT RAISE(ABORT, 'the audit stays'); END;
"""


class Entry(NamedTuple):
    """One thing that was done or refused. ``repeats``: how often the same came before it without a row of its own."""

    at: float  # Unix time, s
    who: str
    address: str
    robot: str
    door: str
    operation: str
    outcome: str  # "done", or the protocol's word for the refusal
    reason: str = ""
    repeats: int = 0


class _Kind(NamedTuple):
    """Same things that came one after another: when a row was written, how many came since, and the last of them."""

    written: float
    repeats: int
    last: Entry


class BrokenChain(ValueError):
    """A row is missing or was changed."""


class Audit:
    """Opens, or makes, the table at ``path``; ``note`` from any thread, ``close`` at the end."""

    def __init__(self, path: Path) -> None:
        self._queue: queue.SimpleQueue[Entry | None] = queue.SimpleQueue()
        self._path = path
        self._kinds: dict[tuple[str, ...], _Kind] = {}
        self._lock = threading.Lock()
        self._dropped = 0
        _open(path).close()  # an unusable file is found now, not in the thread
        self._thread = threading.Thread(target=self._write, name="audit", daemon=True)
        self._thread.start()

    def note(self, entry: Entry) -> None:
        """Keep it. The same within REPEATED_WITHIN is only counted: a joystick sends 50 commands a second."""
        host = entry.address.rpartition(":")[0]  # another connection of it is not another kind
        key = (entry.who, host, *entry[3:8])
        with self._lock:
            kind = self._kinds.get(key)
            if kind is not None and entry.at - kind.written < REPEATED_WITHIN:
                self._kinds[key] = _Kind(kind.written, kind.repeats + 1, entry)
                return
            if kind is None and len(self._kinds) >= KINDS_MAX:
                self._put_repeats(self._kinds.pop(next(iter(self._kinds))))
            self._kinds[key] = _Kind(entry.at, 0, entry)
            self._put(entry._replace(repeats=kind.repeats if kind else 0))

    def close(self) -> None:
        """Write what waits, then close the file."""
        self._settle(math.inf)
        self._queue.put(None)
        self._thread.join(5.0)

    def _settle(self, until: float) -> None:
        """Write what was only counted, if nothing of its kind came for a while."""
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
        with contextlib.closing(_open(self._path)) as connection:
            last = connection.execute("SELECT hash FROM audit ORDER BY number DESC LIMIT 1").fetchone()
            digest = last[0] if last else ""
            while True:
                try:
                    entry = self._queue.get(timeout=REPEATED_WITHIN)
                except queue.Empty:
                    self._settle(now())
                    continue
                if entry is None:
                    return
                try:
                    digest = _append(connection, entry, digest)
                except sqlite3.Error as error:
                    log.error("cannot write the audit: %s", error)


def read(path: Path, *, robot: str = "", after: int = 0) -> Iterator[tuple[int, Entry]]:
    """Rows with their numbers from the one behind ``after`` on, of one robot or of all."""
    query = "SELECT * FROM audit WHERE number > ? AND (? = '' OR robot = ?) ORDER BY number"
    with contextlib.closing(_open(path)) as connection:
        for number, *fields, _ in connection.execute(query, (after, robot, robot)):
            yield number, Entry(*fields)


def verify(path: Path) -> tuple[int, str]:
    """How many rows there are, and the hash of the last: kept elsewhere, it shows later that none was cut off.

    Raises BrokenChain naming the first row that does not fit.
    """
    digest, count = "", 0
    with contextlib.closing(_open(path)) as connection:
        for number, *fields, kept in connection.execute("SELECT * FROM audit ORDER BY number"):
            count += 1
            digest = _hash(digest, number, Entry(*fields))
            if number != count or digest != kept:
                raise BrokenChain(f"row {count} does not fit the rows before it: the audit was changed there")
    return count, digest


def now() -> float:
    """The machine's time, Unix s."""
    return time.time()


def _append(connection: sqlite3.Connection, entry: Entry, before: str) -> str:
    cut = entry._replace(
        who=entry.who[:TEXT_MAX],
        address=entry.address[:TEXT_MAX],
        operation=entry.operation[:TEXT_MAX],
        outcome=entry.outcome[:TEXT_MAX],
        reason=entry.reason[:TEXT_MAX].encode("utf-8", "replace").decode(),
    )
    connection.execute("BEGIN IMMEDIATE")
    try:
        number = connection.execute("SELECT ifnull(max(number), 0) + 1 FROM audit").fetchone()[0]
        digest = _hash(before, number, cut)
        connection.execute("INSERT INTO audit VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)", (number, *cut, digest))
    except BaseException:
        connection.execute("ROLLBACK")
        raise
    connection.execute("COMMIT")
    return digest


def _hash(before: str, number: int, entry: Entry) -> str:
    return hashlib.sha256(json.dumps([before, number, *entry]).encode()).hexdigest()


def _open(path: Path) -> sqlite3.Connection:
    path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
    path.touch(mode=0o600)
    connection = sqlite3.connect(path, isolation_level=None, timeout=5.0)
    connection.executescript("PRAGMA journal_mode=WAL; PRAGMA synchronous=NORMAL;")
    connection.executescript(_SCHEMA)
    return connection
