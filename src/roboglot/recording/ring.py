"""The last minutes, kept in memory, compressed second by second; written to a file when something went wrong."""

from __future__ import annotations

import pickle
import threading
from collections import deque
from pathlib import Path

import zstandard

from roboglot.recording.entries import NANO, Entry
from roboglot.recording.files import Origin, PartWriter
from roboglot.recording.redaction import Redaction

BYTES_MAX = 64 << 20  # of compressed entries; what is older goes first
BLOCK_SECONDS = 1.0


class Ring:
    """A sink that forgets. ``save`` may be called from any thread."""

    def __init__(self, origin: Origin, redaction: Redaction, seconds: float = 300.0) -> None:
        self._origin, self._redaction, self._seconds = origin, redaction, seconds
        self._blocks: deque[tuple[int, bytes]] = deque()
        self._bytes = 0
        self._open: list[Entry] = []
        self._lock = threading.Lock()

    @property
    def size(self) -> int:
        """Bytes in memory."""
        return self._bytes

    def write(self, entry: Entry) -> None:
        """Keep one entry, and forget those that are too old."""
        with self._lock:
            if self._open and entry.at - self._open[0].at > BLOCK_SECONDS * NANO:
                self._close_block()
            self._open.append(entry)

    def flush(self) -> None:
        """Nothing is safe here."""

    def close(self) -> None:
        """Forget all."""
        with self._lock:
            self._blocks.clear()
            self._open.clear()
            self._bytes = 0

    def save(self, path: Path) -> int:
        """Write what is kept into a new file; returns how many entries. Raises OSError."""
        with self._lock:
            blocks, rest = [data for _, data in self._blocks], list(self._open)
        first = rest[0].at if rest else 0
        if blocks:
            first = self._unpack(blocks[0])[0].at
        part, count = PartWriter(path, self._origin, self._redaction, first), 0
        try:
            for entries in (*map(self._unpack, blocks), rest):
                for entry in entries:
                    part.write(entry)
                    count += 1
                part.flush()
        finally:
            part.close()
        return count

    def _close_block(self) -> None:
        data = zstandard.compress(pickle.dumps(self._open, pickle.HIGHEST_PROTOCOL))
        self._blocks.append((self._open[-1].at, data))
        self._bytes += len(data)
        newest = self._open[-1].at
        self._open = []
        while self._blocks and (self._bytes > BYTES_MAX or self._blocks[0][0] < newest - self._seconds * NANO):
            self._bytes -= len(self._blocks.popleft()[1])

    @staticmethod
    def _unpack(data: bytes) -> list[Entry]:
        entries: list[Entry] = pickle.loads(zstandard.decompress(data))  # our own, from this process's memory
        return entries
