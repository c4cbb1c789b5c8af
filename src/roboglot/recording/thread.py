"""The writer thread: entries wait in a bounded queue, and the event loop never waits for a disk."""

from __future__ import annotations

import logging
import threading
from collections import deque
from collections.abc import Sequence
from typing import Protocol

from roboglot.recording.entries import Entry

log = logging.getLogger(__name__)
ENTRIES_MAX = 20_000  # queued
BYTES_MAX = 64 << 20
PERIOD = 0.5  # s between two writes, each with a flush


class Sink(Protocol):
    """Receiver of entries; called in the thread alone."""

    def write(self, entry: Entry) -> None:
        """Add an entry. Raises OSError."""

    def flush(self) -> None:
        """Hand all entries to the system, so that they survive the process. Raises OSError."""

    def close(self) -> None:
        """Finish and close. Raises OSError."""


class WriterThread:
    """``put`` from the event loop or any thread; ``close`` writes the queue. A full queue drops and counts entries.

    ``patient``: ``put`` waits for room instead (in lockstep, where time stands still meanwhile).
    """

    def __init__(self, sink: Sink, *, patient: bool = False) -> None:
        self._sink, self._patient = sink, patient
        self._queue: deque[Entry] = deque()
        self._weight = 0
        self._lock = threading.RLock()  # the garbage collector may log, and so put, in the midst of a put
        self._room = threading.Condition(self._lock)
        self._wake = threading.Event()
        self._settled = threading.Event()
        self._ending = False
        self.dropped = 0
        self.failure = ""  # why writing has stopped, in plain words
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        self._thread.start()

    def put(self, entry: Entry) -> bool:
        """Queue an entry; return False if it was dropped."""
        weight = entry.weight
        with self._lock:  # a plain lock is faster than a condition, which is Python code
            while self._patient and not self.failure and not self._ending and self._full(weight):
                self._wake.set()
                self._room.wait(PERIOD)
            if self.failure or self._ending or self._full(weight):
                self.dropped += 1
                return False
            self._queue.append(entry)
            self._weight += weight
            return True

    def put_all(self, entries: Sequence[Entry]) -> None:
        """Queue entries of one instant; locks once for all."""
        if self._patient:
            for entry in entries:
                self.put(entry)
            return
        weight = sum([entry.weight for entry in entries])
        with self._lock:
            if self.failure or self._ending or self._full(weight):
                self.dropped += len(entries)
            else:
                self._queue += entries
                self._weight += weight

    def settle(self, patience: float = 10.0) -> None:
        """Return when everything queued now is in the sink, or after ``patience`` s."""
        with self._room:
            self._settled.clear()
        self._wake.set()
        self._settled.wait(patience)

    def _full(self, weight: int) -> bool:
        return len(self._queue) >= ENTRIES_MAX or (bool(self._queue) and self._weight + weight > BYTES_MAX)

    def close(self, patience: float = 10.0) -> None:
        """Write the queue and close the sink; return when done, or after ``patience`` s."""
        self._ending = True
        self._wake.set()
        self._thread.join(patience)

    def _run(self) -> None:
        while not self._ending:
            self._wake.wait(PERIOD)
            self._wake.clear()
            settling = not self._settled.is_set()
            self._write(self._take())
            if settling:
                self._settled.set()
        self._write(self._take())
        self._settled.set()
        try:
            self._sink.close()
        except OSError as error:
            self._fail(error)

    def _take(self) -> Sequence[Entry]:
        with self._room:
            taken, self._queue = self._queue, deque()
            self._weight = 0
            self._room.notify_all()
        return taken

    def _write(self, entries: Sequence[Entry]) -> None:
        if self.failure:
            return
        try:
            for entry in entries:
                self._write_one(entry)
            self._sink.flush()
        except OSError as error:
            self._fail(error)

    def _write_one(self, entry: Entry) -> None:
        try:
            self._sink.write(entry)
        except OSError:
            raise
        except Exception:  # one value that cannot be encoded must not end the recording
            self.dropped += 1
            log.exception("recording: cannot write a value of %s", entry.topic)

    def _fail(self, error: OSError) -> None:
        if self.failure:  # already reported
            return
        self.failure = error.strerror or str(error)
        log.error("recording ends: %s", self.failure)
