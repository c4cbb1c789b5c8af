"""Rows of the audit: which are written, which are only counted."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Iterable, Sequence
from pathlib import Path

import pytest

from roboglot.access import audit
from roboglot.access.trail import Entry, open_trail


def audited(folder: Path, entries: Iterable[Entry]) -> list[Entry]:
    """Note these; the rows that are kept."""
    with open_trail(folder) as trail:
        kept = audit.Audit(trail)
        for entry in entries:
            kept.note(entry)
        kept.close()
        return [entry for _, entry in trail.rows()]


def test_repeated_rows_are_counted(tmp_path: Path) -> None:
    entries = (Entry(number * 0.02, "anna", "", "a", "robomaster", "chassis speed", "done") for number in range(100))
    rows = audited(tmp_path, entries)
    assert [(row.at, row.repeats) for row in rows] == [(0.0, 0), (1.0, 49), (1.98, 48)]
    assert sum(1 + row.repeats for row in rows) == 100, "each is counted, also the last"


def test_audit_counts_entries_pushed_out_by_others(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit, "KINDS_MAX", 3)
    entries = (Entry(n * 0.001, "anna", "", "a", "slamware", f"op {n // 10}", "done") for n in range(60))
    rows = audited(tmp_path, entries)
    assert {row.operation: row.repeats for row in rows} == {f"op {number}": 8 for number in range(6)}
    assert len(rows) == 12


def test_unknown_clients_do_not_fill_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(audit.time, "monotonic", lambda: 0.0)
    entries = [Entry(n * 0.0001, "", f"[2001:db8::{n:x}]:5", "a", "", "", "turned away", "why") for n in range(5000)]
    rows = audited(tmp_path, [*entries, Entry(1.0, "anna", "10.0.0.7:5", "a", "slamware", "op", "done")])
    assert len(rows) == audit.STRANGERS_BURST + 3  # one for all others, their count, and anna's
    assert sum(1 + row.repeats for row in rows) == len(entries) + 1
    assert [row.who for row in rows if row.who] == ["anna"]


def test_counts_are_written_while_other_rows_come(monkeypatch: pytest.MonkeyPatch) -> None:
    """No quiet second is needed: a count that waits for one is lost by ``kill -9``."""
    ticks = itertools.count()
    monkeypatch.setattr(audit, "now", lambda: 0.1 * next(ticks))

    class Busy:
        def __init__(self) -> None:
            self.rows: list[Entry] = []
            self.done = threading.Event()

        def add(self, entries: Sequence[Entry]) -> None:
            self.rows += entries
            if len(self.rows) >= 100 or self.counted:
                self.done.set()
            else:
                kept.note(Entry(0.0, "bert", "", "a", "slamware", f"op {len(self.rows)}", "done"))

        @property
        def counted(self) -> bool:
            return any(row.who == "anna" and row.at == 0.5 for row in self.rows)

    busy = Busy()
    kept = audit.Audit(busy)
    kept.note(Entry(0.0, "anna", "", "a", "robomaster", "chassis speed", "done"))
    kept.note(Entry(0.5, "anna", "", "a", "robomaster", "chassis speed", "done"))
    assert busy.done.wait(10.0)
    assert busy.counted
    kept.close()
