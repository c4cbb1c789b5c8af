"""Claim: before a call that does something, a program waits for three flushes of the disk and half a millisecond at
most, and for nothing before others.

A flush is what the same disk takes to append and sync what a commit adds to the database's log, measured in turns with
it. Wall-clock time, on a temporary file or in the folder given.
"""

from __future__ import annotations

import asyncio
import os
import statistics
import sys
import tempfile
import time
from pathlib import Path

from _claim import Claims

from roboglot.programs.engine.journal import Journal, header_of
from roboglot.storage.database import Database
from roboglot.storage.journals import DatabaseJournalStore

ROUNDS, CALLS = 6, 50
PAGE = bytes(4120)  # bytes that a commit adds to the database's log
ANSWER = b'{"t":"value","value":null}'


def flush(descriptor: int) -> float:
    began = time.perf_counter()
    os.write(descriptor, PAGE)
    os.fdatasync(descriptor)
    return time.perf_counter() - began


async def call(journal: Journal, name: str) -> float:
    """Return the time that the program waits for the journal."""
    began = time.perf_counter()
    await journal.begin(name)
    waited = time.perf_counter() - began
    journal.answered(name, ANSWER)
    return waited


async def measure(folder: Path) -> None:
    claims = Claims()
    database = Database(folder / "robot.db")
    journal = Journal(DatabaseJournalStore(database, "a"), "task")
    await journal.open(header_of("pass", {}, 0))
    descriptor = os.open(folder / "plain", os.O_CREAT | os.O_WRONLY | os.O_APPEND)
    flushes, doing, reading = [], [], []
    for _ in range(ROUNDS):
        flushes += [flush(descriptor) for _ in range(CALLS)]
        doing += [await call(journal, "cyberdog.motion.turn") for _ in range(CALLS)]
        reading += [await call(journal, "cyberdog.bms.data") for _ in range(CALLS)]
        await asyncio.sleep(0.2)  # the last answers have been written
    os.close(descriptor)
    await journal.close()
    database.close()
    once = statistics.median(flushes) * 1000
    print(f"a flush of this disk: {once:.3f} ms")
    claims.at_most("call that does something, journal", statistics.median(doing) * 1000, 3 * once + 0.5, "ms")
    claims.at_most("call that reads, journal", statistics.median(reading) * 1e6, 60, "us")
    claims.finish()


def main() -> None:
    """Measure in the folder given, or in a temporary one."""
    with tempfile.TemporaryDirectory(dir=sys.argv[1] if len(sys.argv) > 1 else None) as folder:
        asyncio.run(measure(Path(folder)))


if __name__ == "__main__":
    main()
