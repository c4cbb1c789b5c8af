"""The last minutes, kept in memory, compressed second by second; written to a file after a fault.

Latched values (the map, faults) outlive their block: the file begins with them.
"""

from __future__ import annotations

import pickle
import threading
from collections import deque
from pathlib import Path

import zstandard

from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Origin, PartWriter
from roboglot.recording.latched_values import LATCHED, LATCHED_MAX
from roboglot.recording.redaction import Redaction

BYTES_MAX = 64 << 20  # of compressed entries; older ones are dropped first
BLOCK_SECONDS = 1.0


class Ring:
    """A sink that keeps the newest entries. ``save`` may be called from any thread."""

    def __init__(self, origin: Origin, redaction: Redaction, seconds: float = 300.0) -> None:
        self._origin, self._redaction, self._seconds = origin, redaction, seconds
        self._blocks: deque[tuple[int, bytes]] = deque()
        self._latched: dict[str, bytes] = {}  # by topic: the last entry before the first block
        self._bytes = 0
        self._open: list[Entry] = []
        self._lock = threading.Lock()

    @property
    def size(self) -> int:
        """Size in memory, bytes."""
        return self._bytes

    def write(self, entry: Entry) -> None:
        """Keep one entry, and drop those that are too old."""
        with self._lock:
            if self._open and entry.at - self._open[0].at > BLOCK_SECONDS * NANO:
                self._close_block()
            self._open.append(entry)

    def flush(self) -> None:
        """Do nothing: entries are in memory only."""

    def close(self) -> None:
        """Drop all entries."""
        with self._lock:
            self._blocks.clear()
            self._latched.clear()
            self._open.clear()
            self._bytes = 0

    def save(self, path: Path) -> int:
        """Write the ring's entries into a new file; returns their number. Raises OSError."""
        with self._lock:
            blocks, rest = [data for _, data in self._blocks], list(self._open)
            latched = list(self._latched.values())
        first = rest[0].at if rest else 0
        if blocks:
            first = self._unpack(blocks[0])[0].at
        part, count = PartWriter(path, self._origin, self._redaction, first), 0
        try:
            before = [entry._replace(at=first) for data in latched for entry in self._unpack(data)]
            for entries in (before, *map(self._unpack, blocks), rest):
                for entry in entries:
                    part.write(entry)
                    count += 1
                part.flush()
        finally:
            part.close()
        return count

    def _close_block(self) -> None:
        data = self._pack(self._open)
        self._blocks.append((self._open[-1].at, data))
        self._bytes += len(data)
        newest = self._open[-1].at
        self._open = []
        while self._blocks and (self._bytes > BYTES_MAX or self._blocks[0][0] < newest - self._seconds * NANO):
            self._forget(self._blocks.popleft()[1])

    def _forget(self, block: bytes) -> None:
        self._bytes -= len(block)
        last = {entry.topic: entry for entry in self._unpack(block) if entry.kind in LATCHED}
        for topic, entry in last.items():
            if topic in self._latched or len(self._latched) < LATCHED_MAX:
                self._latched[topic] = self._pack([entry])

    @staticmethod
    def _pack(entries: list[Entry]) -> bytes:
        return zstandard.compress(pickle.dumps(entries, pickle.HIGHEST_PROTOCOL))

    @staticmethod
    def _unpack(data: bytes) -> list[Entry]:
        entries: list[Entry] = pickle.loads(zstandard.decompress(data))  # our own, from this process
        return entries
