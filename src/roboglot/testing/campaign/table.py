"""The table of a campaign: a CSV file that gets a row at the end of each trial."""

from __future__ import annotations

import csv
import fcntl
import io
import os
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import NamedTuple, get_type_hints

from roboglot.testing.campaign.trials import FINAL, Outcome, Result, Trial
from roboglot.text_files import replacing


class OtherCampaign(ValueError):
    """The table is not the beginning of this campaign, or no table; the message says why."""


class Row(NamedTuple):
    """One trial that has ended."""

    scenario: str
    name: str
    seed: int
    outcome: str
    why: str
    seconds: float
    attempts: int
    fingerprint: str


HEAD = Row._fields


class Table:
    """An open table, until ``close``. Raises OtherCampaign for a file that is not a table or is in use."""

    def __init__(self, path: Path) -> None:
        path.parent.mkdir(parents=True, exist_ok=True)
        self.path = path
        self._file = path.open("a+b")
        try:
            fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            self._file.close()
            raise OtherCampaign(f"another campaign writes {path}") from None
        try:
            rows = self._read()
        except OtherCampaign:
            self._file.close()
            raise
        self._found = {(row.scenario, row.seed): row for row in rows}
        self._written = len(rows)
        if not self._file.tell():
            self._write(HEAD)

    def done(self, trial: Trial) -> bool:
        """Return whether the table has a final result of the trial. Raises OtherCampaign for another version of it."""
        row = self._found.get((trial.label, trial.seed))
        if row is not None and row.fingerprint != trial.fingerprint:
            raise OtherCampaign(
                f"{self.path} was made with another version of {trial.label} or of roboglot: choose another --out"
            )
        return row is not None and row.outcome in FINAL

    def add(self, trial: Trial, result: Result) -> Row:
        """Write the row of a trial to disk and return it."""
        row = Row(
            trial.label,
            " ".join(trial.name.split()),  # each row is written in one go, so that no partial one is read
            trial.seed,
            result.outcome,
            " ".join(result.why.split()),
            round(result.seconds, 3),
            result.attempts,
            trial.fingerprint,
        )
        self._write(row)
        self._written += 1
        self._found[row.scenario, row.seed] = row
        return row

    @property
    def rows(self) -> Sequence[Row]:
        """The last row of each trial."""
        return list(self._found.values())

    def close(self) -> None:
        """Keep one row per trial, and unlock the file."""
        try:
            if self._written > len(self._found):
                self._leave_the_last()
        finally:
            self._file.close()

    def _leave_the_last(self) -> None:
        """Replace the file by one without superseded rows of trials that were played again."""
        with replacing(self.path) as fresh, fresh.open("wb") as file:
            for values in (HEAD, *self._found.values()):
                file.write(_line(values))
            file.flush()
            os.fsync(file.fileno())

    def _write(self, values: Sequence[object]) -> None:
        """Write a row to disk. Raises OSError with the file's name."""
        try:
            self._file.write(_line(values))
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise OSError(error.errno, error.strerror, str(self.path)) from None

    def _read(self) -> Sequence[Row]:
        """Read the table; a partial line left by a kill is cut off."""
        self._file.seek(0)
        data, head = self._file.read(), ",".join(HEAD).encode() + b"\n"
        if not (data.startswith(head) or head.startswith(data)):
            raise OtherCampaign(f"{self.path} is not a table of a campaign")
        whole = data.rfind(b"\n") + 1
        try:
            rows = [_row(line) for line in csv.reader(io.StringIO(data[len(head) : whole].decode("utf-8", "replace")))]
        except (ValueError, TypeError, csv.Error) as error:
            raise OtherCampaign(f"{self.path} is not a table of a campaign: {error}") from None
        self._file.truncate(whole)
        self._file.seek(whole)
        return rows


def _line(values: Sequence[object]) -> bytes:
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(values)
    return line.getvalue().encode()


def _row(line: Sequence[str]) -> Row:
    scenario, name, seed, outcome, why, seconds, attempts, fingerprint = line
    return Row(scenario, name, int(seed), Outcome(outcome), why, float(seconds), int(attempts), fingerprint)


def write_parquet(rows: Sequence[Row], path: Path) -> bool:
    """Write the table for data tools, null for no reason; False where pyarrow is not installed."""
    if find_spec("pyarrow") is None:
        path.unlink(missing_ok=True)  # of an earlier run
        return False
    pyarrow, parquet = import_module("pyarrow"), import_module("pyarrow.parquet")
    types = {str: pyarrow.string(), int: pyarrow.int64(), float: pyarrow.float64()}
    schema = pyarrow.schema([(name, types[kind]) for name, kind in get_type_hints(Row).items()])
    plain = [{**row._asdict(), "outcome": str(row.outcome), "why": row.why or None} for row in rows]
    with replacing(path) as fresh:
        parquet.write_table(pyarrow.Table.from_pylist(plain, schema), fresh)
    return True
